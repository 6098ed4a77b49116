"""What the stamps of a topic with a fixed rate tell: samples missing, repeated, out of order.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.

Stamps that jitter, as a phone's do, have no such steps. Each sample then has a place on the grid of the rate,
which follows the stamps slowly, and one that shares a place because its stamp is late or early takes the
empty one near it. Only equal stamps, or more samples than places, are samples twice.

A stamp far from those of the samples around it is no time of a sample: misdated, and counted as that alone.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.messages.compact_times import CompactTimes, Times, distinct, is_in, together
from mount_recorder.stamp_watch import FARTHEST, LONGEST_PAUSE

_NANOSECONDS = 1_000_000_000
_LEAST_SAMPLES = 10
_MOSTLY = 0.9  # share, chosen
_JITTER = 0.25  # periods, chosen: steps so far from whole ones are no clock's drift
_FOLLOWS = 0.05  # chosen: share of a stamp's distance by which the grid follows it
_AT_ONCE = 1 << 16  # steps that are sorted at once, chosen
_NEAR = 3  # periods, chosen: a stamp farther off than that is no late one
_MOST = 0.7  # share, chosen: a topic that lost more than that has no rate to speak of
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


def stamp_statistics(stamps: CompactTimes, rate: float) -> StampStatistics:
    """Return the statistics of `stamps` (ns, in the order of arrival) of a topic with `rate` in Hz."""
    if not len(stamps):
        return StampStatistics(0, 0, 0, 0, 0, math.nan)
    ordered = stamps.ordered()
    expected, taken, longest, jittering = 1, 1, 0, False
    for differences in ordered.steps():
        periods = differences * (rate / _NANOSECONDS)
        steps = np.rint(periods)
        jittering |= bool(np.any((np.abs(periods - steps) > _JITTER) | ((steps == 0) & (differences > 0))))
        expected, taken = expected + int(steps.sum()), taken + int(np.count_nonzero(steps))
        longest = max(longest, int(differences.max(initial=0)))
    if jittering:
        expected, taken = _places(ordered, rate)
    return StampStatistics(
        expected=expected,
        present=len(stamps),
        lost=expected - taken,
        duplicated=len(stamps) - taken,
        out_of_order=0 if stamps.rising else _out_of_order(stamps),
        longest_gap=longest / _NANOSECONDS if len(stamps) > 1 else math.nan,
    )


def _out_of_order(stamps: CompactTimes) -> int:
    """Return how many stamps are below one before them."""
    late, latest = 0, stamps.least
    for block in stamps.blocks():
        before = np.maximum.accumulate(np.append(latest, block))
        late += int(np.count_nonzero(block < before[:-1]))
        latest = before[-1]
    return late


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
    near = np.unique((long[:, None] + np.arange(1 - _AROUND, _AROUND + 1)).clip(0, len(stamps) - 1))
    edges = np.pad(stamps, _AROUND, mode='reflect' if stamps.size > _AROUND else 'edge')
    around = np.lib.stride_tricks.sliding_window_view(edges, 2 * _AROUND + 1)[near]
    wrong[near] = np.abs(stamps[near] - np.sort(around, axis=1)[:, _AROUND]) > FARTHEST
    ordered = np.sort(stamps[~wrong])
    borders = np.flatnonzero(np.diff(ordered) > LONGEST_PAUSE) + 1
    longest = max(np.split(ordered, borders), key=len)
    return wrong | (stamps < longest[0]) | (stamps > longest[-1]) if longest.size else wrong


def redated(stamps: Times, wrong: NDArray[np.bool_], rate: float) -> Times:
    """Return `stamps` with those that are `wrong` set to where `rate` (Hz) puts their samples."""
    if not wrong.any() or wrong.all():
        return stamps
    known = np.flatnonzero(~wrong)
    places = np.arange(len(stamps))
    before = known[np.maximum(np.searchsorted(known, places, side='right') - 1, 0)]
    return stamps[before] + np.rint((places - before) * (_NANOSECONDS / rate)).astype(np.int64)


def missing_samples(streams: Sequence[CompactTimes], rate: float) -> int:
    """Return how many samples are missing in at least one of `streams` that carry their parts.

    `streams` are stamps (ns) on one clock, of samples at `rate` in Hz. A stream is whole before its first and
    behind its last stamp; a sample that is missing in several counts once.
    """
    known = [stamps.ordered() for stamps in streams if len(stamps)]
    if not known:
        return 0
    last, number = min(stamps.least for stamps in known), 0
    last_own: list[int | None] = [None for _ in known]
    begins, ends = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for pieces in together(known):
        grid = np.unique(np.concatenate(pieces))
        steps = np.rint(np.diff(grid, prepend=last) * (rate / _NANOSECONDS)).astype(np.int64)
        numbers = number + np.cumsum(steps)
        last, number = int(grid[-1]), int(numbers[-1])
        for place, stamps in enumerate(pieces):
            own = numbers[np.searchsorted(grid, stamps)]
            if (before := last_own[place]) is not None:
                own = np.append(before, own)
            if own.size:
                last_own[place] = int(own[-1])
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


def _places(stamps: CompactTimes, rate: float) -> tuple[int, int]:
    """Return how many places the grid under jittering `stamps` (ns, sorted) has, and how many are taken."""
    places = CompactTimes()
    for block in _grid(stamps, rate):
        places.add(block)
    first, last = 0, places.finished().highest
    shared = np.concatenate(list(_repeated(places)))
    nearest = np.array(sorted(range(-_NEAR, _NEAR + 1), key=abs))
    empty = _none_at(places, shared, nearest)
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


def _repeated(places: CompactTimes) -> Iterator[Times]:
    """Yield those of rising places that are the one before them once more."""
    last = -1
    for block in places.blocks():
        yield block[np.diff(block, prepend=last) == 0]
        last = int(block[-1])


def _none_at(places: CompactTimes, known: Times, steps: Times) -> NDArray[np.bool_]:
    """Return at which `steps` from each of `known` places, which rise, there is none; (known, steps)."""
    none = np.ones((len(known), len(steps)), bool)
    for block in places.blocks():
        near = slice(*np.searchsorted(known, [block[0] - steps.max(), block[-1] - steps.min() + 1]))
        none[near] &= ~is_in(known[near, None] + steps, block)
    return none


def _grid(stamps: CompactTimes, rate: float) -> Iterator[Times]:
    """Yield the place of each distinct stamp on a grid that follows them, block by block."""
    phase, place, known = 0.0, 0, stamps.least - 1
    for block in stamps.blocks():
        new = distinct(block[block > known])
        known, places = int(block[-1]), []
        for position in ((new - stamps.least) * (rate / _NANOSECONDS)).tolist():
            place = max(place, round(position - phase))
            phase += _FOLLOWS * (position - phase - place)
            places.append(place)
        yield np.array(places, np.int64)


@dataclass(frozen=True)
class StampJitter:
    """How far the steps between neighbouring samples are from their median, in s; NaN without steps."""

    rms: float
    worst: float


def stamp_jitter(stamps: CompactTimes, rate: float) -> StampJitter:
    """Return the jitter of `stamps` (ns) at `rate` in Hz; gaps are no jitter."""
    steps, counts = _counted(
        steps[np.rint(steps * (rate / _NANOSECONDS)) == 1] for steps in stamps.ordered().steps()
    )
    if not steps.size:
        return StampJitter(math.nan, math.nan)
    total, below = int(counts.sum()), np.cumsum(counts)
    middle = steps[np.searchsorted(below, [(total - 1) // 2, total // 2], side='right')]
    deviation = (steps - np.mean(middle)) / _NANOSECONDS
    square = math.fsum((counts * deviation**2).tolist()) / total
    return StampJitter(math.sqrt(square), float(np.abs(deviation).max()))


def _counted(blocks: Iterable[Times]) -> tuple[Times, NDArray[np.int64]]:
    """Return which numbers there are in the blocks, rising, and how often each is there."""
    known, counts = np.empty(0, np.int64), np.empty(0, np.int64)
    waiting: list[Times] = []
    for block in blocks:
        waiting.append(block)
        if sum(map(len, waiting)) > max(_AT_ONCE, len(known)):
            known, counts = _with_more(known, counts, waiting)
            waiting = []
    return _with_more(known, counts, waiting)


def _with_more(
    known: Times, counts: NDArray[np.int64], more: Sequence[Times]
) -> tuple[Times, NDArray[np.int64]]:
    each = np.concatenate([known, *more])
    found, places = np.unique(each, return_inverse=True)
    weights = np.concatenate([counts, np.ones(len(each) - len(known), np.int64)])
    return found, np.bincount(places, weights, len(found)).astype(np.int64)


def regular_rate(stamps: CompactTimes) -> float | None:
    """Return the rate (Hz) of samples without a declared one, None where their stamps (ns) show none.

    Regular are at least 10 samples of which nearly none is repeated, where most steps are one period and
    nearly all are within a quarter of a period of whole ones.
    """
    ordered = stamps.ordered()
    steps = np.concatenate([[0], *(steps[steps > 0] for steps in ordered.steps())])[1:]
    if steps.size + 1 < _LEAST_SAMPLES or steps.size + 1 < _MOSTLY * len(stamps):
        return None
    period = float(np.median(steps))
    periods = np.rint(steps / period)
    fitting = np.abs(steps - periods * period) <= 0.25 * period
    single = np.mean(periods == 1)
    return _NANOSECONDS / period if np.mean(fitting) >= _MOSTLY and single >= _MOST else None
