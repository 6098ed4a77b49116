"""What went wrong during a drive: errors of nodes, marks of faults, and a coil without setpoints."""

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.events import recorded_marks
from engine_mount.recordings.node_reports import CONTROL, node_reports
from engine_mount.recordings.recording import Recording
from mount_models.sampling import SETPOINT_TIMEOUT
from mount_recorder.automatic_marks import MarkKind
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import DISPLACEMENT

_SAME = 5.0  # s, chosen: a mark that repeats the sentence of a report so soon is of the same fault
_NUMBERS = re.compile(r'\d+(\.\d+)?')


class Fault(NamedTuple):
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
    answers = [entry.answers for entry in audits.values() if entry.answers is not None]
    found = [
        Fault(
            axis.of_stamp(begin),
            CONTROL,
            f'no setpoint in time for {1e-6 * (end - begin):.0f} ms (limit {1e3 * SETPOINT_TIMEOUT:g} ms): '
            'the coil went to 0 A',
        )
        for each in answers
        for begin, end in each.silences
    ]
    mounts = {
        name.removesuffix(DISPLACEMENT.name).strip('/')
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is DISPLACEMENT
    }
    present: dict[tuple[str, str], str] = {}  # an error counts once; other numbers make no other error
    for report in reports:
        who, what = (report.namespace, report.node), _NUMBERS.sub('#', report.sentence)
        if mounts and report.namespace not in mounts:
            continue
        if not report.is_error:
            present.pop(who, None)
        elif present.get(who) != what:
            present[who] = what
            found.append(Fault(axis.of_log(report.log_time), report.node, report.sentence))
    known = tuple(found)
    for marks in recorded_marks(recording).values():
        for logged, mark in marks:
            time = axis.of_mark(mark.time, logged)
            if mark.kind == MarkKind.FAULT.value and not any(
                abs(time - fault.time) < _SAME and fault.sentence in mark.text and fault.node in mark.text
                for fault in known
            ):
                found.append(Fault(time, '', mark.text))
    spans = [span for each in answers for span in each.spans]
    begin, end = -math.inf, math.inf
    if spans:
        begin, last = axis.of_stamp(min(spans)[0]), axis.of_stamp(max(end for _, end in spans))
        inactive = [
            axis.of_log(report.log_time)
            for report in reports
            if report.node == CONTROL and report.state == 'inactive'
        ]
        end = min((time for time in inactive if time >= last), default=math.inf)
    return sorted((fault for fault in found if begin <= fault.time <= end), key=lambda fault: fault.time)
