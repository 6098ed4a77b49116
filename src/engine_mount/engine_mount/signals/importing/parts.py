"""Signals of several files on one time axis, and their parts between gaps: each a drive of its own."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from engine_mount.signals.even_grid import gaps
from engine_mount.signals.importing.channels import (
    ACCELERATION,
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    LONGEST_GAP,
    SHORTEST,
)
from engine_mount.signals.signal import SECOND, Signal, SignalError

Signals = Mapping[str, Signal]
DATED = 500_000_000 * SECOND
"""ns, 1985: what begins later counts from 1970, and is no clock of its own."""
DRIVING = (DISPLACEMENT, ENGINE, CHASSIS, ACCELERATION)
"""Quantities that controller or simulated car follow: a longer gap in one parts the recording."""
_FEWEST = 10  # samples of a signal, as `engine_mount.signals.signal` needs
Span = tuple[int, int]  # begin and end, ns


@dataclass(frozen=True, eq=False)
class Part:
    """What of all signals lies between two gaps; `begin` and `end` in ns on the clock of the signals."""

    begin: int
    end: int
    signals: Signals

    def later(self, shift: int) -> 'Part':
        """Return the same, `shift` ns later."""
        moved = {name: replace(one, begin=one.begin + shift) for name, one in self.signals.items()}
        return Part(self.begin + shift, self.end + shift, moved)


def join_files(files: Sequence[tuple[str, Signals]]) -> tuple[dict[str, Signal], list[str]]:
    """Return the signals of all files, (name, signals) each, on one axis, and sentences on how.

    Files with dates keep them; files that count from a zero of their own are taken to have begun together.
    A quantity in several files continues from one to the next. Raises `SignalError` where it overlaps, where
    its files have no dates, and where some files have dates and others none.
    """
    undated = [name for name, own in files if not all(one.begin > DATED for one in own.values())]
    if undated and len(undated) < len(files):
        raise SignalError(
            f'{", ".join(undated)} tells no date, the other files do: when they began against each other is '
            'not known; import them apart'
        )
    notes = []
    if undated and len(files) > 1:
        notes.append('the files tell no dates: their times are taken to count from the same zero')
    found: dict[str, list[tuple[str, Signal]]] = {}
    for name, own in files:
        for quantity, signal in own.items():
            found.setdefault(quantity, []).append((name, signal))
    return {quantity: _continued(quantity, parts) for quantity, parts in found.items()}, notes


def within(signals: Signals, first: float | None, last: float | None) -> Signals:
    """Return the signals from `first` to `last` (s after the first sample of all); None is no bound."""
    if first is None and last is None:
        return signals
    zero, end = _whole(signals.values())
    begin = zero + round(SECOND * (first or 0.0))
    until = end if last is None else zero + round(SECOND * last)
    if not zero <= begin < until or begin >= end:
        raise SignalError(
            f'from {first or 0.0:g} s to {(until - zero) / SECOND:g} s there is nothing to take: the signals '
            f'last {(end - zero) / SECOND:.3f} s'
        )
    return _part(signals, (begin, until)).signals


def parts_of(signals: Signals) -> tuple[list[Part], list[str]]:
    """Return the parts of `signals` (SI) without gaps of more than `LONGEST_GAP`, and sentences on the cuts.

    Raises `SignalError` where no part is as long as `SHORTEST`.
    """
    driving = [signal for name, signal in signals.items() if name in DRIVING]
    spans = _spans(driving) if driving else [_whole(signals.values())]
    long_enough = [span for span in spans if span[1] - span[0] >= SHORTEST * SECOND]
    if not long_enough:
        longest = max((end - begin for begin, end in spans), default=0) / SECOND
        raise SignalError(
            f'{", ".join(one.name for one in driving or signals.values())}: the longest part without a gap '
            f'of more than {LONGEST_GAP:g} s is {longest:.3f} s long; {SHORTEST:g} s are needed'
        )
    notes = [
        f'a gap of {(after - end) / SECOND:.3f} s at {(end - spans[0][0]) / SECOND:.3f} s: what follows it '
        'is a drive of its own'
        for (_, end), (after, _) in pairwise(spans)
    ]
    short = len(spans) - len(long_enough)
    if short:
        notes.append(f'{short} parts shorter than {SHORTEST:g} s between gaps are left out')
    return [_part(signals, span) for span in long_enough], notes


def _continued(quantity: str, parts: list[tuple[str, Signal]]) -> Signal:
    """Return the signals of several files one behind the other."""
    if len(parts) == 1:
        return parts[0][1]
    parts = sorted(parts, key=lambda part: part[1].begin)
    for (name, before), (next_name, after) in pairwise(parts):
        end = before.begin + round(SECOND * float(before.times[-1]))
        if after.begin <= end:
            raise SignalError(
                f'{quantity} is in {name} until {end / SECOND:.3f} s and in {next_name} from '
                f'{after.begin / SECOND:.3f} s: they overlap; name in which file it is, or import them apart'
            )
    every = [signal for _, signal in parts]
    return replace(
        every[0],
        times=np.concatenate([one.times + (one.begin - every[0].begin) / SECOND for one in every]),
        values=np.concatenate([one.values for one in every]),
        notes=tuple(dict.fromkeys(note for one in every for note in one.notes)),
    )


def _whole(signals: Collection[Signal]) -> Span:
    begins = [one.begin + round(SECOND * float(one.times.min())) for one in signals]
    ends = [one.begin + round(SECOND * float(one.times.max())) for one in signals]
    return min(begins), max(ends)


def _spans(signals: Sequence[Signal]) -> list[Span]:
    """Return where all signals are without gaps, in order."""
    own = [_whole([signal]) for signal in signals]
    at, end = max(begin for begin, _ in own), min(end for _, end in own)
    pauses: list[list[int]] = []
    for signal in signals:
        places = gaps(signal, LONGEST_GAP)
        sides = np.stack([signal.times[places], signal.times[places + 1]], axis=1)
        pauses += (signal.begin + np.rint(SECOND * sides).astype(np.int64)).tolist()
    spans = []
    for before, after in [*sorted(pauses), [end, end]]:
        if min(before, end) > at:
            spans.append((at, min(before, end)))
        at = max(at, after)
    return spans


def _part(signals: Signals, span: Span) -> Part:
    found = {name: _between(signal, span) for name, signal in signals.items()}
    return Part(*span, {name: signal for name, signal in found.items() if signal is not None})


def _between(signal: Signal, span: Span) -> Signal | None:
    """Return the samples of a signal between two times (ns), both included; None where there are too few."""
    begin, end = ((edge - signal.begin) / SECOND for edge in span)
    slack = 0.5 / SECOND  # of the rounding to ns
    inside = (signal.times >= begin - slack) & (signal.times <= end + slack)
    if inside.all():
        return signal
    if np.count_nonzero(inside) < _FEWEST:
        return None
    times = signal.times[inside]
    shift = float(times[0])
    return replace(
        signal, times=times - shift, values=signal.values[inside], begin=signal.begin + round(SECOND * shift)
    )
