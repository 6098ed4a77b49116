"""What went wrong during a drive: errors of nodes, marks of faults, and a coil without setpoints."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from engine_mount.recordings.audit.audit import CONTROL, TopicAudit
from engine_mount.recordings.audit.node_reports import NodeReport, node_reports
from engine_mount.recordings.events.recorded_events import recorded_marks
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.time_axis import TimeAxis
from mount_models.sampling import SETPOINT_TIMEOUT
from mount_recorder.automatic_marks import MarkKind
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import DISPLACEMENT

_SAME = 5.0  # s, chosen: a mark that repeats the sentence of a report so soon is of the same fault
_NUMBERS = re.compile(r'\d+(\.\d+)?')


@dataclass(frozen=True)
class Fault:
    """One fault: when (s on the recording's time axis), what, and the node that says so, if any."""

    time: float
    node: str
    sentence: str

    def __str__(self) -> str:
        return f'{self.time:.3f} s {self.node + ": " if self.node else ""}{self.sentence}'


def faults(recording: Recording, audits: Mapping[str, TopicAudit]) -> list[Fault]:
    """Return the faults of a recording in the order of time; `audits` is its audit.

    They count from control's first answer until it was deactivated for the last time: starting and ending the
    graph have verdicts of their own. Without an answer of control, all count.
    """
    axis, reports = recording.time_axis, node_reports(recording)
    found = [*_silences(audits, axis), *_errors(recording, reports, axis)]
    found += _marks(recording, found, axis)
    begin, end = _drive(reports, audits, axis)
    return sorted((fault for fault in found if begin <= fault.time <= end), key=lambda fault: fault.time)


def _drive(
    reports: Sequence[NodeReport], audits: Mapping[str, TopicAudit], axis: TimeAxis
) -> tuple[float, float]:
    """Return from when to when the mounts of a recording were driven."""
    spans = [span for entry in audits.values() if entry.answers for span in entry.answers.spans]
    if not spans:
        return -float('inf'), float('inf')
    last = axis.of_stamp(max(end for _, end in spans))
    ended = [
        time
        for report in reports
        if report.node == CONTROL
        and report.state == 'inactive'
        and (time := axis.of_log(report.log_time)) >= last
    ]
    return axis.of_stamp(min(begin for begin, _ in spans)), min(ended, default=float('inf'))


def _silences(audits: Mapping[str, TopicAudit], axis: TimeAxis) -> list[Fault]:
    return [
        Fault(
            axis.of_stamp(silence.begin),
            CONTROL,
            f'no setpoint in time for {1e3 * silence.duration:.0f} ms (limit {1e3 * SETPOINT_TIMEOUT:g} ms): '
            'the coil went to 0 A',
        )
        for entry in audits.values()
        if entry.answers is not None
        for silence in entry.answers.silences
    ]


def _errors(recording: Recording, reports: Sequence[NodeReport], axis: TimeAxis) -> list[Fault]:
    """Return where a node began to report an error, or another one; numbers in a sentence make no other."""
    mounts = {
        name.removesuffix(DISPLACEMENT.name).strip('/')
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is DISPLACEMENT
    }
    found: list[Fault] = []
    present: dict[tuple[str, str], str] = {}
    for report in reports:
        if mounts and report.namespace not in mounts:
            continue
        who, what = (report.namespace, report.node), _NUMBERS.sub('#', report.sentence)
        if not report.is_error:
            present.pop(who, None)
        elif present.get(who) != what:
            present[who] = what
            found.append(Fault(axis.of_log(report.log_time), report.node, report.sentence))
    return found


def _marks(recording: Recording, known: Sequence[Fault], axis: TimeAxis) -> list[Fault]:
    """Return the marks of faults that no report tells of already."""
    dated = [
        (axis.of_mark(mark.time, logged), mark)
        for marks in recorded_marks(recording).values()
        for logged, mark in marks
    ]
    return [
        Fault(time, '', mark.text)
        for time, mark in dated
        if mark.kind == MarkKind.FAULT.value and not _is_repeated(time, mark.text, known)
    ]


def _is_repeated(time: float, text: str, known: Sequence[Fault]) -> bool:
    return any(
        abs(time - fault.time) < _SAME and fault.sentence in text and fault.node in text for fault in known
    )
