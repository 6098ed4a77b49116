"""What the nodes of a recording said of themselves on `/diagnostics`."""

import sys
from dataclasses import dataclass

from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from mount_ros.messages.verdicts import NodeVerdict, verdicts_in
from mount_ros.topics import DIAGNOSTICS

_AT_ONCE = 256  # messages in memory, chosen
CONTROL = 'mount_control'  # the node
_ERROR = 2  # diagnostic_msgs/DiagnosticStatus.ERROR


@dataclass(frozen=True, slots=True)
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
        if recording.topics[recording.resolve(DIAGNOSTICS.name)].type != DIAGNOSTICS.type:
            return []
        reports = [
            _report(time, verdict)
            for series in recording.parts([DIAGNOSTICS.name], _AT_ONCE)
            for time, message in zip(series.receive_times.tolist(), series.messages(), strict=True)
            for verdict in verdicts_in(message)
        ]
    except (ReadingError, SeriesError):
        return []
    return sorted(reports, key=lambda report: report.log_time)


def _report(log_time: int, verdict: NodeVerdict) -> NodeReport:
    namespace, _, node = verdict.node.rpartition('/')
    texts = (namespace.strip('/'), node, verdict.sentence, verdict.figures.get('state', ''))
    namespace, node, sentence, state = map(sys.intern, texts)  # very many are alike
    return NodeReport(log_time, namespace, node, verdict.level, sentence, state)
