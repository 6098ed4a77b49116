"""What a recording lacks and what went wrong in it: the figures that every command tells, and their words.

Faults are errors of nodes, marks of faults, and a coil without setpoints.
"""

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.difference import few
from engine_mount.recordings.events import CONTROL, node_reports, recorded_marks
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Table
from engine_mount.recordings.session import told_session
from mount_models.sampling import SETPOINT_TIMEOUT
from mount_recorder.automatic_marks import MarkKind
from mount_ros.topics import DIAGNOSTICS

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
    mounts = recording.mounts
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


class Losses(NamedTuple):
    """The figures of one recording, of all its mounts together.

    `lost_samples` of `samples` were taken by the electronics and lack their displacement or ripple;
    `lost_messages` are those of any topic that were sent and are not there. While control was active,
    `asked` samples were taken, of which `unanswered` have no setpoint and `late` one that came too late to be
    used. `misdated` messages have a stamp that is none of a sample. None where the recording cannot tell.
    `unjudged` is the reason why no node reports faults, empty where nodes do.
    """

    samples: int | None
    lost_samples: int | None
    lost_messages: int | None
    asked: int | None
    unanswered: int | None
    late: int | None
    misdated: int
    faults: tuple[Fault, ...]
    whole: bool  # nothing of the recording is known to be damaged or missing
    unjudged: str = ''

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, unanswered or wrong: the rule of the exit code."""
        return not self.complaints()

    @property
    def lossless(self) -> bool:
        """Whether nothing is known to be lost."""
        return self.whole and not self.lost_samples and not self.lost_messages

    def complaints(self) -> list[str]:
        """Return a sentence for each figure that is not as it should be."""
        first = f'{len(self.faults)}, the first at {self.faults[0]}' if self.faults else ''
        rules = (
            (self.lost_samples or self.lost_messages, f'samples lost: {self.lost_text()}'),
            (self.unanswered, f'samples unanswered: {self.answers_text()}'),
            (self.misdated, f'messages misdated: {self.misdated}; the audit tells their topics'),
            (self.faults, f'faults: {first}'),
            (not self.whole, 'the recording is not whole'),
        )
        return [sentence for broken, sentence in rules if broken]

    def rows(self) -> list[tuple[str, str]]:
        """Return names and texts of the figures, as every command and report tells them."""
        return [
            ('samples lost', self.lost_text()),
            ('samples unanswered', self.answers_text()),
            ('faults', self.faults_text()),
        ]

    def lost_text(self) -> str:
        """Return the lost samples and messages in words."""
        if self.lost_samples is None:
            return 'cannot be told' if self.lost_messages is None else f'{self.lost_messages} messages'
        messages = f' ({self.lost_messages} messages of all topics)' if self.lost_messages else ''
        return f'{self.lost_samples} of {self.samples}{messages}'

    def answers_text(self) -> str:
        """Return the unanswered and the late samples in words."""
        if self.unanswered is None:
            return 'cannot be told, no setpoint was recorded'
        late = f'; {self.late} answered later than {1e3 * SETPOINT_TIMEOUT:g} ms' if self.late else ''
        return f'{self.unanswered} of {self.asked} while control was active{late}'

    def faults_text(self) -> str:
        """Return how many faults there are, and the first in words, each on a line of its own."""
        if not self.faults:
            return f'not judged: {self.unjudged}' if self.unjudged else 'none'
        return f'{len(self.faults)}:\n' + few([*map(str, self.faults)], ';\n')

    def as_json(self) -> dict[str, Any]:
        """Return the figures as JSON knows them: unknown is null, times are in s."""
        return {
            'samples': self.samples,
            'lost_samples': self.lost_samples,
            'lost_messages': self.lost_messages,
            'asked_samples': self.asked,
            'unanswered_samples': self.unanswered,
            'late_samples': self.late,
            'misdated_messages': self.misdated,
            'faults': [
                {'time_s': round(fault.time, 6), 'node': fault.node or None, 'sentence': fault.sentence}
                for fault in self.faults
            ],
        }


def losses(recording: Recording, audits: Mapping[str, TopicAudit]) -> Losses:
    """Return the figures of a recording from its audit."""
    sampled = [entry for entry in audits.values() if entry.lost_samples is not None]
    answers = [entry.answers for entry in audits.values() if entry.answers is not None]
    unjudged = ''
    if DIAGNOSTICS.name not in audits or not audits[DIAGNOSTICS.name].present:
        core = told_session(recording).get('mode') == 'core'
        unjudged = 'core has no watches' if core else 'no diagnostics recorded'
    return Losses(
        samples=_sum(entry.expected for entry in sampled),
        lost_samples=_sum(entry.lost_samples for entry in sampled),
        lost_messages=_sum(entry.lost for entry in audits.values()),
        asked=_sum(each.asked for each in answers),
        unanswered=_sum(each.unanswered for each in answers),
        late=_sum(each.late for each in answers),
        misdated=_sum(entry.misdated for entry in audits.values()) or 0,
        faults=tuple(faults(recording, audits)),
        whole=recording.whole,
        unjudged=unjudged,
    )


def _sum(counts: Iterable[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if known else None


# The audit for people and for programs.

_FIGURES = (
    *('expected', 'present', 'lost', 'duplicated', 'longest_gap_s', 'out_of_order', 'misdated'),
    *('rate_hz', 'remark'),
)
_COLUMNS = (
    ('expected', 'expected', 1),
    ('present', 'present', 1),
    ('lost', 'lost', 1),
    ('gap ms', 'longest_gap_s', 1e3),
)
_TROUBLES = (('twice', 'duplicated', 1), ('late', 'out_of_order', 1), ('misdated', 'misdated', 1))


def as_json(audits: Mapping[str, TopicAudit], found: Losses) -> dict[str, Any]:
    """Return the figures as JSON knows them: unknown is null; times are in s."""
    topics = {}
    for name, entry in audits.items():
        figures = {figure: getattr(entry, figure) for figure in _FIGURES}
        topics[name] = {figure: None if value != value else value for figure, value in figures.items()}
        latency = entry.latency and {f'{key}_s': value for key, value in entry.latency._asdict().items()}
        topics[name]['latency'] = latency
    return {**found.as_json(), 'topics': topics}


def as_table(audits: Mapping[str, TopicAudit]) -> Table:
    """Return the figures as a table; columns of troubles are left out where no topic has them."""
    troubles = [each for each in _TROUBLES if any(getattr(entry, each[1]) for entry in audits.values())]
    columns = [*_COLUMNS, *troubles]
    heads = ('topic', *(head for head, _, _ in columns))
    rows = [
        (name, *(_cell(getattr(entry, figure), factor) for _, figure, factor in columns))
        for name, entry in audits.items()
    ]
    marked = frozenset(place for place, entry in enumerate(audits.values()) if not entry.sound)
    return Table('Was anything lost?', 'l' + 'r' * (len(heads) - 1), rows, heads, marked=marked)


def sentences(audits: Mapping[str, TopicAudit], found: Losses) -> list[str]:
    """Return what the figures mean, the verdict last."""
    remarks: dict[str, list[str]] = {}
    for name, entry in audits.items():
        if entry.remark:
            remarks.setdefault(entry.remark, []).append(name)
    lines = [f'{", ".join(names)}: {remark}' for remark, names in remarks.items()]
    if found.samples is not None:
        lines += [f'{what}: {text}' for what, text in found.rows()]
    return [*lines, _verdict(audits, found)]


def latency_sentences(audits: Mapping[str, TopicAudit]) -> list[str]:
    """Return a sentence for each topic whose latency is known."""
    return [
        f'{name}: from the stamp to the setpoint at the recorder, median '
        f'{1e3 * entry.latency.median:.2f} ms, '
        f'99 % below {1e3 * entry.latency.p99:.2f} ms, worst {1e3 * entry.latency.worst:.2f} ms'
        for name, entry in audits.items()
        if entry.latency is not None
    ]


def _verdict(audits: Mapping[str, TopicAudit], found: Losses) -> str:
    lost = [f'{entry.lost} of {name}' for name, entry in audits.items() if entry.lost]
    rules = (
        (lost, f'Lost: {", ".join(lost)}'),
        (found.misdated, f'Misdated: {found.misdated} messages'),
        (found.unanswered, f'Unanswered: {found.unanswered} samples'),
        (found.faults, f'Faults: {len(found.faults)}'),
    )
    broken = [sentence for figure, sentence in rules if figure]
    if broken:
        return '. '.join(broken) + '.'
    if not found.whole:
        return 'The recording is not whole: what the notes say is missing, its stamps cannot show.'
    present = [entry for entry in audits.values() if entry.present]
    if not present:
        return 'The recording is empty: no message came, so none could be lost.'
    judged = sum(entry.expected is not None for entry in present)
    if not judged:
        return 'Whether anything was lost cannot be told: no topic has stamps with a rate, none was counted.'
    others = len(present) - judged
    rest = f'; of {others} others it cannot be told' if others else ''
    return f'Nothing is known to be lost: {judged} topics are complete{rest}.'


def _cell(figure: float | None, factor: float) -> str:
    if figure is None or math.isnan(figure):
        return ''
    return str(figure) if factor == 1 else f'{factor * figure:.1f}'
