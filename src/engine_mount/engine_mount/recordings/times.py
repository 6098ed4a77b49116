"""Times of messages in ns; samples that are missing, repeated or out of order by their stamps.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.

Stamps that jitter, as a phone's do, have no such steps. Each sample then has a place on the grid of the rate,
which follows the stamps slowly, and one that shares a place because its stamp is late or early takes the
empty one near it. Only equal stamps, or more samples than places, are samples twice.

A stamp far from those of the samples around it is no time of a sample: misdated, and counted as that alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mount_recorder.stamp_watch import FARTHEST, LONGEST_PAUSE

Times = NDArray[np.int64]

NO_TIMES: Times = np.empty(0, np.int64)
_NANOSECONDS = 1_000_000_000
_LEAST_SAMPLES = 10
_MOSTLY = 0.9  # share, chosen
_JITTER = 0.25  # periods, chosen: steps so far from whole ones are no clock's drift
_FOLLOWS = 0.05  # chosen: share of a stamp's distance by which the grid follows it
_NEAR = 3  # periods, chosen: a stamp farther off than that is no late one
_MOST = 0.7  # share, chosen: a topic that lost more than that has no rate to speak of
_AROUND = 5  # samples, chosen: before and behind; so many stamps in a row may be misdated


def distinct(times: Times) -> Times:
    """Return the distinct times, rising; `np.unique` hashes them, which takes ten times as long."""
    if bool((times[1:] > times[:-1]).all()):
        return times
    times = ordered(times)
    return times[np.append(True, times[1:] > times[:-1])]


def ordered(times: Times) -> Times:
    """Return times sorted; no copy where they are."""
    return times if bool((times[1:] >= times[:-1]).all()) else np.sort(times)


def each_once(times: Times) -> tuple[Times, 'slice | NDArray[np.intp]']:
    """Return the distinct times, rising, and where the first of each stands; no copies where they rise."""
    if bool((times[1:] > times[:-1]).all()):
        return times, slice(None)
    return np.unique(times, return_index=True)


def shared(times: Times, known: list[Times]) -> Times:
    """Return the array in `known` that equals `times`, which is added if there is none."""
    for each in known:
        if np.array_equal(each, times):
            return each
    known.append(times)
    return times


def is_in(times: Times, known: Times) -> NDArray[np.bool_]:
    """Return which of the times are among `known`, which rise."""
    if not len(known):
        return np.zeros(len(times), bool)
    return known[np.minimum(np.searchsorted(known, times), len(known) - 1)] == times


@dataclass(frozen=True)
class StampStatistics:
    """Counts of samples; `longest_gap_s` between neighbouring stamps in s, NaN below two samples."""

    expected: int
    present: int
    lost: int
    duplicated: int
    out_of_order: int
    longest_gap_s: float


def stamp_statistics(stamps: Times, rate: float) -> StampStatistics:
    """Return the statistics of `stamps` (ns, in the order of arrival) of a topic with `rate` in Hz."""
    if not len(stamps):
        return StampStatistics(0, 0, 0, 0, 0, math.nan)
    rising = ordered(stamps)
    differences = np.diff(rising)
    periods = differences * (rate / _NANOSECONDS)
    steps = np.rint(periods)
    expected, filled = 1 + int(steps.sum()), 1 + int(np.count_nonzero(steps))
    if np.any((np.abs(periods - steps) > _JITTER) | ((steps == 0) & (differences > 0))):
        expected, filled = _places(rising, rate)
    return StampStatistics(
        expected=expected,
        present=len(stamps),
        lost=expected - filled,
        duplicated=len(stamps) - filled,
        out_of_order=0 if rising is stamps else _out_of_order(stamps),
        longest_gap_s=int(differences.max()) / _NANOSECONDS if len(stamps) > 1 else math.nan,
    )


def _out_of_order(stamps: Times) -> int:
    """Return how many stamps are below one before them."""
    return int(np.count_nonzero(stamps[1:] < np.maximum.accumulate(stamps)[:-1]))


def misdated(stamps: Times) -> NDArray[np.bool_]:
    """Return which of `stamps` (ns, in the order of arrival) cannot be the times of their samples."""
    wrong = np.zeros(len(stamps), bool)
    if stamps.size < 3:
        return wrong
    steps = np.abs(np.diff(stamps))
    if not (steps > FARTHEST).any():
        return wrong
    # Where no step is so long, none of those around a stamp is too far from it.
    long = np.flatnonzero(steps > FARTHEST // _AROUND)
    near = (long[:, None] + np.arange(1 - _AROUND, _AROUND + 1)).clip(0, len(stamps) - 1)
    near = distinct(near.ravel())
    edges = np.pad(stamps, _AROUND, mode='reflect' if stamps.size > _AROUND else 'edge')
    around = np.lib.stride_tricks.sliding_window_view(edges, 2 * _AROUND + 1)[near]
    wrong[near] = np.abs(stamps[near] - np.sort(around, axis=1)[:, _AROUND]) > FARTHEST
    sound = np.sort(stamps[~wrong])
    borders = np.flatnonzero(np.diff(sound) > LONGEST_PAUSE) + 1
    longest = max(np.split(sound, borders), key=len)
    return wrong | (stamps < longest[0]) | (stamps > longest[-1]) if longest.size else wrong


def redated(stamps: Times, wrong: NDArray[np.bool_], rate: float) -> Times:
    """Return `stamps` with those that are `wrong` set to where `rate` (Hz) puts their samples."""
    if not wrong.any() or wrong.all():
        return stamps
    known = np.flatnonzero(~wrong)
    places = np.arange(len(stamps))
    before = known[np.maximum(np.searchsorted(known, places, side='right') - 1, 0)]
    return stamps[before] + np.rint((places - before) * (_NANOSECONDS / rate)).astype(np.int64)


def missing_samples(streams: Sequence[Times], rate: float) -> int:
    """Return how many samples are missing in at least one of `streams` that carry their parts.

    `streams` are stamps (ns) on one clock, of samples at `rate` in Hz. A stream is whole before its first and
    behind its last stamp; a sample that is missing in several counts once.
    """
    known = {id(stamps): distinct(stamps) for stamps in streams if len(stamps)}
    if not known:
        return 0
    grid = distinct(np.concatenate(list(known.values()))) if len(known) > 1 else next(iter(known.values()))
    numbers = np.cumsum(np.rint(np.diff(grid, prepend=grid[0]) * (rate / _NANOSECONDS)).astype(np.int64))
    begins, ends = [NO_TIMES], [NO_TIMES]
    for stamps in known.values():
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


def _places(stamps: Times, rate: float) -> tuple[int, int]:
    """Return how many places the grid under jittering `stamps` (ns, sorted) has, and how many are filled."""
    places = _grid(stamps, rate)
    first, last = 0, int(places[-1])
    shared = places[np.diff(places, prepend=-1) == 0]
    nearest = np.array(sorted(range(-_NEAR, _NEAR + 1), key=abs))
    empty = ~is_in(shared[:, None] + nearest, places)
    added: set[int] = set()
    for place, is_empty in zip(shared.tolist(), empty, strict=True):
        near = (place + nearest[is_empty]).tolist()
        inside = [one for one in near if one not in added and first <= one <= last]
        if inside:
            added.add(inside[0])
        elif place - first < _NEAR:  # a late first stamp hides the place before it
            first -= 1
            added.add(first)
        elif last - place < _NEAR:
            last += 1
            added.add(last)
    return last - first + 1, len(places) - len(shared) + len(added)


def _grid(stamps: Times, rate: float) -> Times:
    """Return the place of each distinct stamp on a grid that follows them."""
    phase, place, places = 0.0, 0, list[int]()
    for position in ((distinct(stamps) - stamps[0]) * (rate / _NANOSECONDS)).tolist():
        place = max(place, round(position - phase))
        phase += _FOLLOWS * (position - phase - place)
        places.append(place)
    return np.array(places, np.int64)


def stamp_jitter(stamps: Times, rate: float) -> tuple[float, float]:
    """Return how far steps between samples at `rate` (Hz) are from their median, in s: rms and at most.

    Stamps are in ns. Gaps are no jitter; NaN without steps.
    """
    steps = np.diff(ordered(stamps))
    steps = steps[np.rint(steps * (rate / _NANOSECONDS)) == 1]
    if not steps.size:
        return math.nan, math.nan
    lengths, counts = np.unique(steps, return_counts=True)
    deviation = (lengths - np.median(steps)) / _NANOSECONDS
    square = math.fsum((counts * deviation**2).tolist()) / steps.size
    return math.sqrt(square), float(np.abs(deviation).max())


def regular_rate(stamps: Times) -> float | None:
    """Return the rate (Hz) of samples without a declared one, None where their stamps (ns) show none.

    Regular are at least 10 samples of which nearly none is repeated, where most steps are one period and
    nearly all are within a quarter of a period of whole ones.
    """
    steps = np.diff(distinct(stamps))
    if steps.size + 1 < _LEAST_SAMPLES or steps.size + 1 < _MOSTLY * len(stamps):
        return None
    period = float(np.median(steps))
    periods = np.rint(steps / period)
    fitting = np.abs(steps - periods * period) <= 0.25 * period
    single = np.mean(periods == 1)
    return _NANOSECONDS / period if np.mean(fitting) >= _MOSTLY and single >= _MOST else None
