"""Signals cut at their gaps, so that a pause costs two drives instead of a refusal."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from engine_mount.signals.even_grid import gaps
from engine_mount.signals.importing.one_grid import CHASSIS, DISPLACEMENT, ENGINE, SHORTEST
from engine_mount.signals.signal import SECOND, Signal, SignalError

LONGEST_GAP = 0.125
"""s: one period of the 8 Hz at which an engine moves on its mounts cannot be interpolated."""
DRIVING = (DISPLACEMENT, ENGINE, CHASSIS, 'acceleration')
"""Quantities that controller or simulated car follow: a longer gap in one parts the recording."""
_FEWEST = 10  # samples of a signal, as `engine_mount.signals.signal` needs
Span = tuple[int, int]  # begin and end, ns


@dataclass(frozen=True, eq=False)
class Piece:
    """What of all signals lies between two gaps; `begin` and `end` in ns on the clock of the signals."""

    begin: int
    end: int
    signals: Mapping[str, Signal]


def pieces(signals: Mapping[str, Signal]) -> tuple[list[Piece], list[str]]:
    """Return the parts of `signals` (SI) without gaps of more than `LONGEST_GAP`, and sentences on the cuts.

    Raises `SignalError` where no part is as long as `SHORTEST`.
    """
    driving = {name: signal for name, signal in signals.items() if name in DRIVING}
    spans: list[Span] = [_whole(signals.values())] if not driving else []
    for number, signal in enumerate(driving.values()):
        own = _spans(signal)
        spans = own if number == 0 else _common(spans, own)
    long_enough = [span for span in spans if span[1] - span[0] >= SHORTEST * SECOND]
    if not long_enough:
        longest = max((end - begin for begin, end in spans), default=0) / SECOND
        raise SignalError(
            f'{_names(driving or signals)}: the longest part without a gap of more than {LONGEST_GAP:g} s is '
            f'{longest:.3f} s long; {SHORTEST:g} s are needed'
        )
    notes = [_cut(before, after, spans[0][0]) for before, after in pairwise(spans)]
    short = len(spans) - len(long_enough)
    if short:
        notes.append(f'{short} parts shorter than {SHORTEST:g} s between gaps are left out')
    return [_piece(signals, span) for span in long_enough], notes


def within(signals: Mapping[str, Signal], first: float | None, last: float | None) -> dict[str, Signal]:
    """Return the signals from `first` to `last` (s after the first sample of all); None is no bound."""
    if first is None and last is None:
        return dict(signals)
    zero, end = _whole(signals.values())
    begin = zero + round(SECOND * (first or 0.0))
    until = end if last is None else zero + round(SECOND * last)
    if not zero <= begin < until or begin >= end:
        raise SignalError(
            f'from {first or 0.0:g} s to {(until - zero) / SECOND:g} s there is nothing to take: the signals '
            f'last {(end - zero) / SECOND:.3f} s'
        )
    found = {name: _between(signal, (begin, until)) for name, signal in signals.items()}
    return {name: signal for name, signal in found.items() if signal is not None}


def _whole(signals: Collection[Signal]) -> Span:
    begins = [signal.begin + round(SECOND * float(signal.times.min())) for signal in signals]
    ends = [signal.begin + round(SECOND * float(signal.times.max())) for signal in signals]
    return min(begins), max(ends)


def _spans(signal: Signal) -> list[Span]:
    """Return where a signal is without gaps."""
    places = gaps(signal, LONGEST_GAP)
    edges = np.concatenate([[0], places + 1, [signal.times.size]])
    times = signal.times
    return [
        (
            signal.begin + round(SECOND * float(times[first])),
            signal.begin + round(SECOND * float(times[behind - 1])),
        )
        for first, behind in pairwise(edges.tolist())
    ]


def _common(some: Sequence[Span], others: Sequence[Span]) -> list[Span]:
    """Return where both are, in order."""
    both = [(max(a, c), min(b, d)) for a, b in some for c, d in others if max(a, c) < min(b, d)]
    return sorted(both)


def _cut(before: Span, after: Span, zero: int) -> str:
    gap, at = (after[0] - before[1]) / SECOND, (before[1] - zero) / SECOND
    return f'a gap of {gap:.3f} s at {at:.3f} s: what follows it is a drive of its own'


def _piece(signals: Mapping[str, Signal], span: Span) -> Piece:
    found = {name: _between(signal, span) for name, signal in signals.items()}
    return Piece(*span, {name: signal for name, signal in found.items() if signal is not None})


def _between(signal: Signal, span: Span) -> Signal | None:
    """Return the samples of a signal between two times (ns), both included; None where there are too few."""
    begin, end = ((edge - signal.begin) / SECOND for edge in span)
    slack = 0.5 / SECOND  # of the rounding to ns
    inside = (signal.times >= begin - slack) & (signal.times <= end + slack)
    if inside.all():
        return signal
    if np.count_nonzero(inside) < _FEWEST:
        return None
    times, shift = signal.times[inside], float(signal.times[inside][0])
    return replace(
        signal, times=times - shift, values=signal.values[inside], begin=signal.begin + round(SECOND * shift)
    )


def _names(signals: Mapping[str, Signal]) -> str:
    return ', '.join(signal.name for signal in signals.values())
