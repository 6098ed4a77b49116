"""The verdict on a recording: switching, faults, losses, and isolation against the undamped run."""

import math
from collections.abc import Callable

import numpy as np

from engine_mount.recordings.difference import quantity_text, time_text
from engine_mount.reports.drawing.chart import Array
from engine_mount.reports.sections.section import BAD, GOOD, LOOK, UNKNOWN, Cell, Finding, Link
from engine_mount.reports.sections.subject import Subject
from engine_mount.reports.signals import Signal

_AROUND = 0.5  # s, chosen: shown to either side of what a number links to


def findings(subject: Subject, of: str = '') -> list[Finding]:
    """Return the four findings on a recording; `of` names it where there are several."""
    parts: tuple[tuple[str, Callable[[Subject], tuple[str, list[Cell]]]], ...] = (
        ('Switching', _switching),
        ('Faults', _faults),
        ('Losses', _losses),
        ('Isolation', _isolation),
    )
    named = f', {of}' if of else ''
    return [Finding(f'{what}{named}', *judge(subject)) for what, judge in parts]


def _switching(subject: Subject) -> tuple[str, list[Cell]]:
    if subject.facts.without_friction:
        return UNKNOWN, [f'not applicable: {subject.facts.without_friction}']
    spans = subject.signals.damping()
    if spans is None:
        return UNKNOWN, ['when damping was switched was not recorded']
    if not spans:
        return LOOK, ['damping was never switched on']
    total = sum(end - begin for begin, end in spans)
    times = 'once' if len(spans) == 1 else f'{len(spans)} times'
    begin, end = spans[0]
    return GOOD, [
        'damping was switched on',
        Link(times, 'switching'),
        f'and on for {quantity_text(total, "s")} in all, first from',
        Link(time_text(begin), 'traces', begin, _AROUND),
        'to',
        Link(time_text(end), 'traces', end, _AROUND),
    ]


def _faults(subject: Subject) -> tuple[str, list[Cell]]:
    faults = subject.losses.faults
    if not faults:
        return GOOD, [Link('none', 'losses')]
    first = faults[0]
    told = f'{len(faults)}, the first'
    return BAD, [
        Link(told, 'losses'),
        'at',
        Link(time_text(first.time), 'traces', first.time, _AROUND),
        f'{first.node}: {first.sentence}' if first.node else first.sentence,
    ]


def _losses(subject: Subject) -> tuple[str, list[Cell]]:
    found = subject.losses
    text: list[Cell] = [
        'lost:',
        Link(found.lost_text(), 'losses'),
        '· unanswered:',
        Link(found.answers_text(), 'losses'),
    ]
    if found.lost_samples is None and found.lost_messages is None:
        return UNKNOWN, text
    if not found.whole:
        text.append('· the recording is not whole')
    wrong = not found.lossless or found.unanswered or found.misdated
    return (LOOK if wrong else GOOD), text


def _isolation(subject: Subject) -> tuple[str, list[Cell]]:
    undamped = subject.facts.undamped
    if undamped is None:
        return UNKNOWN, [f'against the undamped run unknown: {subject.facts.undamped_remark}']
    moved, shaken = subject.displacement(), subject.acceleration()
    if moved is None:
        return UNKNOWN, ['against the undamped run unknown: no displacement was recorded']
    peak, at = _peak(moved.time, moved.values, undamped.begin)
    other, other_at = _peak(undamped.time, undamped.displacement, undamped.begin)
    if math.isnan(peak) or math.isnan(other):
        return UNKNOWN, ['against the undamped run unknown: the recording ends before the excitation begins']
    text: list[Cell] = [
        'peak displacement',
        Link(quantity_text(peak, 'm'), 'traces', at, _AROUND),
        'against',
        Link(quantity_text(other, 'm'), 'traces', other_at, _AROUND),
        f'undamped ({_change(peak, other)})',
    ]
    calm = Signal(undamped.time, undamped.displacement)
    text.append(f'· rms {_both(moved, calm, undamped.begin, "m")}')
    if shaken is not None:
        calm = Signal(undamped.time, undamped.chassis_acceleration)
        both = _both(shaken, calm, undamped.begin, 'm/s²')
        text += ['·', Link('acceleration of the chassis', 'spectra'), f'rms {both}']
    return (GOOD if peak <= other else LOOK), text


def _both(driven: Signal, undamped: Signal, begin: float, unit: str) -> str:
    """Return the rms of the drive and of the undamped run, in words."""
    rms, other = _rms(driven, begin), _rms(undamped, begin)
    return f'{quantity_text(rms, unit)} against {quantity_text(other, unit)} ({_change(rms, other)})'


def _peak(time: Array, values: Array, begin: float) -> tuple[float, float]:
    """Return the highest absolute value from `begin` (s) on and when it is, NaN where there is none."""
    inside = np.flatnonzero((time >= begin) & np.isfinite(values))
    if not len(inside):
        return math.nan, math.nan
    place = inside[np.argmax(np.abs(values[inside]))]
    return abs(float(values[place])), float(time[place])


def _rms(signal: Signal, begin: float) -> float:
    """Return the rms about the mean of the known values from `begin` (s) on."""
    inside = (signal.time >= begin) & np.isfinite(signal.values)
    return float(np.std(signal.values[inside])) if inside.any() else math.nan


def _change(value: float, reference: float) -> str:
    if not reference > 0.0 or math.isnan(value):
        return 'unknown'
    percent = round(100.0 * (value / reference - 1.0))
    return f'{percent:+d} %' if percent else 'no change'
