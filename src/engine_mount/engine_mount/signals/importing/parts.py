"""Parts of signals between gaps: each a drive of its own."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from engine_mount.signals.importing.channels import (
    ACCELERATION,
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    LONGEST_GAP,
    SHORTEST,
)
from engine_mount.signals.signal import FEWEST, SECOND, Signal, SignalError

DRIVING = (DISPLACEMENT, ENGINE, CHASSIS, ACCELERATION)
"""Quantities that controller or simulated car follow: a longer gap in one parts the recording."""
Span = tuple[int, int]  # begin and end, ns


@dataclass(frozen=True, eq=False)
class Part:
    """What of all signals lies between two gaps; `begin` and `end` in ns on the clock of the signals."""

    begin: int
    end: int
    signals: Mapping[str, Signal]


def parts_of(signals: Mapping[str, Signal]) -> tuple[list[Part], list[str]]:
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
        places = np.flatnonzero(np.diff(signal.times) > LONGEST_GAP)
        sides = np.stack([signal.times[places], signal.times[places + 1]], axis=1)
        pauses += (signal.begin + np.rint(SECOND * sides).astype(np.int64)).tolist()
    spans = []
    for before, after in [*sorted(pauses), [end, end]]:
        if min(before, end) > at:
            spans.append((at, min(before, end)))
        at = max(at, after)
    return spans


def _part(signals: Mapping[str, Signal], span: Span) -> Part:
    """Return the samples between two times, both included; signals with too few there are left out."""
    found = {}
    for name, signal in signals.items():
        begin, end = ((edge - signal.begin) / SECOND for edge in span)
        slack = 0.5 / SECOND  # of the rounding to ns
        inside = (signal.times >= begin - slack) & (signal.times <= end + slack)
        if inside.all():
            found[name] = signal
        elif np.count_nonzero(inside) >= FEWEST:
            times, values = signal.times[inside], signal.values[inside]
            first = signal.begin + round(SECOND * float(times[0]))
            found[name] = replace(signal, times=times - times[0], values=values, begin=first)
    return Part(*span, found)
