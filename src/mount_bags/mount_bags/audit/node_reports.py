"""What the nodes of a recording said of themselves on `/diagnostics`."""

from dataclasses import dataclass

from mount_bags.bag.recording import ReadingError, Recording
from mount_bags.messages.series import SeriesError
from mount_ros.messages.verdicts import ToldVerdict, verdicts_in
from mount_ros.topics import DIAGNOSTICS

_ERROR = 2  # diagnostic_msgs/DiagnosticStatus.ERROR


@dataclass(frozen=True)
class NodeReport:
    """One status: when it was logged (ns), of which node below which namespace, and what it said."""

    log_time: int
    namespace: str  # without slashes at its ends
    node: str
    level: int
    sentence: str
    state: str  # `active`, `inactive`, or empty where it did not say

    @property
    def is_error(self) -> bool:
        """Whether the node reported an error."""
        return self.level == _ERROR


def node_reports(recording: Recording) -> list[NodeReport]:
    """Return all reports in the order of their log times, none where they cannot be read."""
    if DIAGNOSTICS.name not in recording:
        return []
    try:
        series = recording[DIAGNOSTICS.name]
        if series.type != DIAGNOSTICS.type:
            return []
        logged = zip(series.receive_times.tolist(), series.messages(), strict=True)
        reports = [_report(time, told) for time, message in logged for told in verdicts_in(message)]
    except (ReadingError, SeriesError):
        return []
    return sorted(reports, key=lambda report: report.log_time)


def _report(log_time: int, told: ToldVerdict) -> NodeReport:
    namespace, _, node = told.node.rpartition('/')
    state = told.figures.get('state', '')
    return NodeReport(log_time, namespace.strip('/'), node, told.level, told.sentence, state)
