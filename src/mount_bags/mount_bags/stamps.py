"""What the stamps of a topic with a fixed rate tell: samples missing, repeated, out of order.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NANOSECONDS = 1_000_000_000


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
