"""What the stamps of a topic with a fixed rate tell: samples missing, repeated, out of order.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.

Stamps that jitter, as a phone's do, have no such steps. Each sample then has a place on the grid of the rate,
which follows the stamps slowly, and one that shares a place because its stamp is late or early takes the
empty one near it. Only equal stamps, or more samples than places, are samples twice.

A stamp far from those of the samples around it is no time of a sample: misdated, and counted as that alone.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NANOSECONDS = 1_000_000_000
_LEAST_SAMPLES = 10
_MOSTLY = 0.9  # share, chosen
_JITTER = 0.25  # periods, chosen: steps so far from whole ones are no clock's drift
_FOLLOWS = 0.05  # chosen: share of a stamp's distance by which the grid follows it
_NEAR = 3  # periods, chosen: a stamp farther off than that is no late one
_MOST = 0.7  # share, chosen: a topic that lost more than that has no rate to speak of
FARTHEST = 10 * _NANOSECONDS
"""ns, chosen: a stamp farther from the samples that came around it is misdated."""
LONGEST_PAUSE = 3600 * _NANOSECONDS
"""ns, chosen: of the parts of a recording that are farther apart, all but the longest are misdated."""
_AROUND = 5  # samples, chosen: before and behind; so many stamps in a row may be misdated


@dataclass(frozen=True)
class StampStatistics:
    """Counts of samples; `longest_gap` between neighbouring stamps in s, NaN below two samples."""

    expected: int
    present: int
    lost: int
    duplicated: int
    out_of_order: int
    longest_gap: float


def stamp_statistics(stamps: NDArray[np.int64], rate: float) -> StampStatistics:
    """Return the statistics of `stamps` (ns, in the order of arrival) of a topic with `rate` in Hz."""
    if stamps.size == 0:
        return StampStatistics(0, 0, 0, 0, 0, math.nan)
    ordered = np.sort(stamps)
    differences = ordered[1:] - ordered[:-1]
    periods = differences * (rate / _NANOSECONDS)
    steps = np.rint(periods)
    if np.any((np.abs(periods - steps) > _JITTER) | ((steps == 0) & (differences > 0))):
        expected, taken = _places(np.unique(ordered), rate)
    else:
        expected, taken = int(steps.sum()) + 1, 1 + int(np.count_nonzero(steps))
    latest = np.maximum.accumulate(stamps)
    return StampStatistics(
        expected=expected,
        present=int(stamps.size),
        lost=expected - taken,
        duplicated=int(stamps.size) - taken,
        out_of_order=int(np.count_nonzero(stamps[1:] < latest[:-1])),
        longest_gap=float(differences.max()) / _NANOSECONDS if differences.size else math.nan,
    )


def misdated(stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which of `stamps` (ns, in the order of arrival) cannot be the times of their samples."""
    wrong = np.zeros(len(stamps), bool)
    if stamps.size < 3 or not (np.abs(np.diff(stamps)) > FARTHEST).any():
        return wrong
    edges = np.pad(stamps, _AROUND, mode='reflect' if stamps.size > _AROUND else 'edge')
    around = np.lib.stride_tricks.sliding_window_view(edges, 2 * _AROUND + 1)
    wrong = np.abs(stamps - np.sort(around, axis=1)[:, _AROUND]) > FARTHEST
    ordered = np.sort(stamps[~wrong])
    borders = np.flatnonzero(np.diff(ordered) > LONGEST_PAUSE) + 1
    longest = max(np.split(ordered, borders), key=len)
    return wrong | (stamps < longest[0]) | (stamps > longest[-1]) if longest.size else wrong


def redated(stamps: NDArray[np.int64], wrong: NDArray[np.bool_], rate: float) -> NDArray[np.int64]:
    """Return `stamps` with those that are `wrong` set to where `rate` (Hz) puts their samples."""
    if not wrong.any() or wrong.all():
        return stamps
    known = np.flatnonzero(~wrong)
    places = np.arange(len(stamps))
    before = known[np.maximum(np.searchsorted(known, places, side='right') - 1, 0)]
    return stamps[before] + np.rint((places - before) * (_NANOSECONDS / rate)).astype(np.int64)


def missing_samples(streams: Sequence[NDArray[np.int64]], rate: float) -> int:
    """Return how many samples are missing in at least one of `streams` that carry their parts.

    `streams` are stamps (ns) on one clock, of samples at `rate` in Hz. A stream is whole before its first and
    behind its last stamp; a sample that is missing in several counts once.
    """
    known = [np.unique(stamps) for stamps in streams if stamps.size]
    if not known:
        return 0
    grid = np.unique(np.concatenate(known))
    numbers = np.cumsum(np.rint(np.diff(grid, prepend=grid[0]) * (rate / _NANOSECONDS)).astype(np.int64))
    begins, ends = [], []
    for stamps in known:
        own = numbers[np.searchsorted(grid, stamps)]
        before_hole = np.flatnonzero(np.diff(own) > 1)
        begins.append(own[before_hole] + 1)
        ends.append(own[before_hole + 1])
    return _covered(np.concatenate(begins), np.concatenate(ends))


def _covered(begins: NDArray[np.int64], ends: NDArray[np.int64]) -> int:
    """Return how many whole numbers lie in at least one interval, whose ends do not belong to it."""
    order = np.argsort(begins)
    begins, ends = begins[order], ends[order]
    reached = np.concatenate([begins[:1], np.maximum.accumulate(ends)[:-1]])
    return int(np.maximum(ends - np.maximum(begins, reached), 0).sum())


def _places(stamps: NDArray[np.int64], rate: float) -> tuple[int, int]:
    """Return how many places the grid under jittering `stamps` (ns, rising) has, and how many are taken."""
    places, phase, place = [], 0.0, 0
    for position in ((stamps - stamps[0]) * (rate / _NANOSECONDS)).tolist():
        place = max(place, round(position - phase))
        phase += _FOLLOWS * (position - phase - place)
        places.append(place)
    first, last, taken = 0, places[-1], set(places)
    for place in _shared(places):
        near = sorted(range(place - _NEAR, place + _NEAR + 1), key=lambda one: abs(one - place))
        inside = [one for one in near if one not in taken and first <= one <= last]
        if inside:
            taken.add(inside[0])
        elif place - first < _NEAR:  # a late first stamp hides the place before it
            first -= 1
            taken.add(first)
        elif last - place < _NEAR:
            last += 1
            taken.add(last)
    return last - first + 1, len(taken)


def _shared(places: list[int]) -> list[int]:
    return [place for place, following in itertools.pairwise(places) if place == following]


@dataclass(frozen=True)
class StampJitter:
    """How far the steps between neighbouring samples are from their median, in s; NaN without steps."""

    rms: float
    worst: float


def stamp_jitter(stamps: NDArray[np.int64], rate: float) -> StampJitter:
    """Return the jitter of `stamps` (ns) at `rate` in Hz; gaps are no jitter."""
    steps = np.diff(np.sort(stamps))
    single = steps[np.rint(steps * (rate / _NANOSECONDS)) == 1]
    if not single.size:
        return StampJitter(math.nan, math.nan)
    deviation = (single - np.median(single)) / _NANOSECONDS
    return StampJitter(float(np.sqrt(np.mean(deviation**2))), float(np.abs(deviation).max()))


def regular_rate(stamps: NDArray[np.int64]) -> float | None:
    """Return the rate (Hz) of samples without a declared one, None where their stamps (ns) show none.

    Regular are at least 10 samples of which nearly none is repeated, where most steps are one period and
    nearly all are within a quarter of a period of whole ones.
    """
    distinct = np.unique(stamps)
    if distinct.size < _LEAST_SAMPLES or distinct.size < _MOSTLY * stamps.size:
        return None
    steps = np.diff(distinct)
    period = float(np.median(steps))
    periods = np.rint(steps / period)
    fitting = np.abs(steps - periods * period) <= 0.25 * period
    single = np.mean(periods == 1)
    return _NANOSECONDS / period if np.mean(fitting) >= _MOSTLY and single >= _MOST else None


class StampWatch:
    """Counts the same while the samples of a regular clock arrive, one by one."""

    def __init__(self, rate: float):
        self.present = 0
        self.lost = 0
        self.duplicated = 0
        self.out_of_order = 0
        self.misdated = 0
        self.last_stamp = 0  # ns, the latest so far
        self._doubtful: int | None = None  # a stamp far off, until the next tells what it was
        self._period = _NANOSECONDS / rate

    def add(self, stamp: int) -> None:
        """Count the sample of time `stamp` (ns)."""
        self.present += 1
        if self.present == 1:
            self.last_stamp = stamp
            return
        if abs(stamp - self.last_stamp) > FARTHEST and not self._goes_on(stamp):
            return
        self._doubtful = None
        steps = round((stamp - self.last_stamp) / self._period)
        if steps > 0:
            self.lost += steps - 1
            self.last_stamp = stamp
        elif steps == 0:
            self.duplicated += 1
        else:
            self._add_late()

    def _goes_on(self, stamp: int) -> bool:
        """Return whether a stamp far off is the second of two that agree; else it counts as misdated."""
        first, self._doubtful = self._doubtful, stamp
        if first is None or abs(stamp - first) > FARTHEST:
            self.misdated += 1
            return False
        if 0 < first - self.last_stamp < LONGEST_PAUSE:  # else of another clock
            self.misdated -= 1
            self.lost += round((first - self.last_stamp) / self._period) - 1
        self.last_stamp = first
        return True

    def _add_late(self) -> None:
        # A late sample fills a gap that was counted before; without a gap it repeats a sample.
        self.out_of_order += 1
        if self.lost:
            self.lost -= 1
        else:
            self.duplicated += 1
