"""What a report begins with: the verdict, the figures that one wants to see first, and what is missing."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from engine_mount.recordings.difference import quantity_text
from engine_mount.recordings.session import session_values
from engine_mount.reports.drive.signals import error_text
from engine_mount.reports.sections.motion import peak_cell
from engine_mount.reports.sections.run import HEAD_OF_SESSION
from engine_mount.reports.sections.section import (
    BAD,
    GOOD,
    LOOK,
    NOT_APPLICABLE,
    UNKNOWN,
    Cell,
    Finding,
    Link,
    Section,
    Table,
    moment,
)
from engine_mount.reports.sections.subject import Signal, Subject, other_mounts, shared_sentences


def overview(subjects: Sequence[Subject]) -> Section:
    """Return the verdict, the figures, and what the recordings lack, in words."""
    columns = [_cells(subject) for subject in subjects]
    head = ['', *(each.name for each in subjects)]
    rows = [[name, *(column[name] for column in columns)] for name in columns[0]]
    words = [f'{subject.prefix}{warning}.' for subject in subjects for warning in subject.recording.warnings]
    missing = [(each, f'missing: {"; ".join(each.missing)}') for each in subjects if each.missing]
    words += shared_sentences(subjects, missing)
    verdict = [finding for subject in subjects for finding in findings(subject)]
    return Section('overview', 'Overview', words, None, [Table(head, rows)], verdict)


def findings(subject: Subject) -> list[Finding]:
    """Return the four findings on a recording, with its name where there are several."""
    parts = {'Isolation': _isolation, 'Switching': _switching, 'Faults': _faults, 'Losses': _losses}
    of = f', {subject.name}' if subject.prefix else ''
    return [Finding(f'{what}{of}', *judge(subject)) for what, judge in parts.items()]


def _cells(subject: Subject) -> dict[str, Cell]:
    session, figures = session_values(subject.session), subject.figures
    length = figures['duration_s']
    return {
        'recording': str(subject.recording.path),
        **{name: str(session.get(name, 'not known')) for name in HEAD_OF_SESSION},
        'messages': str(subject.recording.message_count),
        'length': 'not known' if length is None else quantity_text(length, 's', 5),
        'peak displacement': peak_cell(subject['displacement'], 'm'),
        **_friction_cells(subject),
        **{name: Link(text, 'losses') for name, text in subject.losses.rows()},
    }


def _friction_cells(subject: Subject) -> dict[str, Cell]:
    figures, cells = subject.figures, {}
    for name, figure, section, text in (
        ('peak current', 'peak_current_a', 'traces', lambda value: quantity_text(value, 'A')),
        ('damping switched on', 'damping_switched_on', 'switching', _times),
        ('friction force error', 'tracking_error_rms', 'tracking', error_text),
    ):
        known: Cell = 'not known' if figures[figure] is None else Link(text(figures[figure]), section)
        reason = subject.run.without_friction
        cells[name] = f'not applicable: {reason}' if reason else known
    return cells


def _switching(subject: Subject) -> tuple[str, Sequence[Cell]]:
    if subject.run.without_friction:
        return NOT_APPLICABLE, [subject.run.without_friction]
    spans = subject.damping
    if spans is None:
        return UNKNOWN, ['when damping was switched was not recorded']
    if not spans:
        return LOOK, ['damping was never switched on']
    total = sum(end - begin for begin, end in spans)
    begin, end = map(moment, spans[0])
    words = ('damping was switched on', f'and on for {quantity_text(total, "s")} in all, first from')
    return GOOD, [words[0], Link(_times(len(spans)), 'switching'), words[1], begin, 'to', end]


def _faults(subject: Subject) -> tuple[str, Sequence[Cell]]:
    found = subject.losses
    if not found.faults:
        return UNKNOWN if found.unjudged else GOOD, [Link(found.faults_text(), 'losses')]
    first = found.faults[0]
    sentence = f'{first.node}: {first.sentence}' if first.node else first.sentence
    return BAD, [Link(f'{len(found.faults)}, the first', 'losses'), 'at', moment(first.time), sentence]


def _losses(subject: Subject) -> tuple[str, Sequence[Cell]]:
    found = subject.losses
    lost, unanswered = Link(found.lost_text(), 'losses'), Link(found.answers_text(), 'losses')
    text: list[Cell] = ['lost:', lost, '· unanswered:', unanswered]
    if found.lost_samples is None and found.lost_messages is None:
        return UNKNOWN, text
    if not found.whole:
        text.append('· the recording is not whole')
    wrong = not found.lossless or found.unanswered or found.misdated
    return (LOOK if wrong else GOOD), text


def _isolation(subject: Subject) -> tuple[str, Sequence[Cell]]:
    beside, moved = subject.beside, subject['displacement']
    unknown = 'against other mounts unknown:'
    if isinstance(beside, str):
        return UNKNOWN, [f'{unknown} {beside}']
    if moved is None:
        return UNKNOWN, [f'{unknown} no displacement was recorded']
    begin = (beside.begin - subject.zero) / 1e9
    peak, at = moved.peak(begin)
    if math.isnan(peak):
        return UNKNOWN, [f'{unknown} the recording ends before the excitation begins']

    def against(quantity: str, unit: str, figure: Callable[[Signal], float]) -> str:
        own, others = figure(subject[quantity]), other_mounts([subject], quantity)
        changes = (
            f'{_change(own, other)} {name} ({quantity_text(other, unit)})'
            for name, other in ((name, figure(signal)) for name, signal in others.items())
        )
        return f'{quantity_text(own, unit)}, {", ".join(changes)}'

    words = [against('displacement', 'm', lambda signal: signal.peak(begin)[0])]
    text: list[Cell] = [Link('peak displacement', 'traces', at), words[0]]
    if subject['acceleration'] is not None:
        words.append(
            against('acceleration', 'm/s²', lambda signal: np.nanstd(signal.values[signal.time >= begin]))
        )
        text += ['·', Link('acceleration of the chassis', 'felt'), f'rms {words[1]}']
    return (LOOK if any('worse' in each for each in words) else GOOD), text


def _change(value: float, reference: float) -> str:
    if not reference > 0.0 or math.isnan(value):
        return 'against'
    percent = round(100.0 * (value / reference - 1.0))
    return f'{"worse" if percent > 0 else "better"} by {abs(percent)} % than' if percent else 'as'


def _times(count: int) -> str:
    return 'once' if count == 1 else f'{count} times'
