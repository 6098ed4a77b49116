"""What the stamps of a topic with a fixed rate tell: samples missing, repeated, out of order.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NANOSECONDS = 1_000_000_000
_LEAST_SAMPLES = 10
_MOSTLY = 0.9  # share, chosen
_MOST = 0.7  # share, chosen: a topic that lost more than that has no rate to speak of


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
    steps = np.rint(differences * (rate / _NANOSECONDS)).astype(np.int64)
    latest = np.maximum.accumulate(stamps)
    return StampStatistics(
        expected=int(steps.sum()) + 1,
        present=int(stamps.size),
        lost=int((steps[steps > 1] - 1).sum()),
        duplicated=int(np.count_nonzero(steps == 0)),
        out_of_order=int(np.count_nonzero(stamps[1:] < latest[:-1])),
        longest_gap=float(differences.max()) / _NANOSECONDS if differences.size else math.nan,
    )


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
    holes = []
    for stamps in known:
        own = numbers[np.searchsorted(grid, stamps)]
        holes.append(np.setdiff1d(np.arange(own[0], own[-1] + 1), own))
    return len(np.unique(np.concatenate(holes)))


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
    """Return the rate (Hz) of samples that nobody declared, None where their stamps (ns) show none.

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
    """Counts the same while the samples arrive, one by one."""

    def __init__(self, rate: float):
        self.present = 0
        self.lost = 0
        self.duplicated = 0
        self.out_of_order = 0
        self.last_stamp = 0  # ns, the latest so far
        self._period = _NANOSECONDS / rate

    def add(self, stamp: int) -> None:
        """Count the sample of time `stamp` (ns)."""
        self.present += 1
        if self.present == 1:
            self.last_stamp = stamp
            return
        steps = round((stamp - self.last_stamp) / self._period)
        if steps > 0:
            self.lost += steps - 1
            self.last_stamp = stamp
        elif steps == 0:
            self.duplicated += 1
        else:
            self._add_late()

    def _add_late(self) -> None:
        # A late sample fills a gap that was counted before; without a gap it repeats a sample.
        self.out_of_order += 1
        if self.lost:
            self.lost -= 1
        else:
            self.duplicated += 1
