"""How two columns of matched samples differ."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.compare.lag import Lag, lag
from engine_mount.recordings.compare.tolerances import Tolerance

Signal = NDArray[np.float64]

_NOT_ASKED = Lag(math.nan)


@dataclass(frozen=True)
class Moment:
    """One matched sample: time in s, values in A and B."""

    time: float
    a: float
    b: float

    @property
    def difference(self) -> float:
        """B minus A."""
        return self.b - self.a


@dataclass(frozen=True)
class SignalDifference:
    """One signal in both recordings; values in `unit`, unknown is NaN.

    `mount` is what stands before the topic where it is of a namespace: `mount_left/`.
    `differing` samples are beyond the tolerance; NaN in one recording alone always is, NaN in both never.
    `first` is the first of them, `largest` the sample with the largest difference of numbers; `rms` is that
    of the differences of numbers over all samples. `exact` says that all samples are equal to the bit.
    """

    mount: str
    topic: str
    signal: str
    unit: str
    samples: int
    differing: int = 0
    exact: bool = True
    unknown_in_one: int = 0
    first: Moment | None = None
    largest: Moment | None = None
    rms: float = 0.0
    scale: float = math.nan
    lag: Lag = _NOT_ASKED

    @property
    def name(self) -> str:
        """Mount, topic and signal."""
        return f'{self.mount}{self.quantity}'

    @property
    def quantity(self) -> str:
        """Topic and signal, of whatever mount."""
        return f'{self.topic}.{self.signal}'

    @property
    def share(self) -> float:
        """The largest difference as a share of the largest value in A; 1 where it cannot be told."""
        if self.largest is None or not self.scale > 0.0:
            return 1.0
        return abs(self.largest.difference) / self.scale


@dataclass(frozen=True)
class Column:
    """One signal of matched samples: where it is from, times (s), values in A and B."""

    mount: str
    topic: str
    signal: str
    unit: str
    time: Signal
    a: Signal
    b: Signal


def signal_difference(
    column: Column, tolerance: Tolerance, places: NDArray[np.int64] | None, period: float
) -> SignalDifference:
    """Return how the two sides of `column` differ beyond `tolerance`.

    `places` numbers the samples in periods (s), for the lag; None where they have no rate.
    """
    origin = column.mount, column.topic, column.signal, column.unit
    a, b = np.ascontiguousarray(column.a, float), np.ascontiguousarray(column.b, float)
    unknown_a, unknown_b = np.isnan(a), np.isnan(b)
    same = (a.view(np.int64) == b.view(np.int64)) | (unknown_a & unknown_b)
    known = ~(unknown_a | unknown_b)
    sizes = np.abs(a[np.isfinite(a)])
    scale = float(sizes.max()) if len(sizes) else math.nan
    if same.all():
        return SignalDifference(*origin, len(a), scale=scale)
    with np.errstate(invalid='ignore'):
        distance = np.where(same, 0.0, np.abs(b - a))
    bound = tolerance.bound(0.0 if math.isnan(scale) else scale)
    # Without a tolerance even the sign of a zero counts.
    far = ~same & (~known | ~(distance <= bound) | (bound == 0.0))
    differing = np.flatnonzero(far)
    numbers = distance[known]
    largest = int(np.flatnonzero(known)[np.argmax(numbers)]) if (known & ~same).any() else None
    return SignalDifference(
        *origin,
        samples=len(a),
        differing=len(differing),
        exact=False,
        unknown_in_one=int(np.count_nonzero(unknown_a != unknown_b)),
        first=_moment(column, int(differing[0])) if len(differing) else None,
        largest=None if largest is None else _moment(column, largest),
        rms=float(np.sqrt(np.mean(numbers**2))) if len(numbers) else math.nan,
        scale=scale,
        lag=_NOT_ASKED if places is None else lag(_evenly(a, places), _evenly(b, places), period),
    )


def _moment(column: Column, place: int) -> Moment:
    return Moment(float(column.time[place]), float(column.a[place]), float(column.b[place]))


def _evenly(values: Signal, places: NDArray[np.int64]) -> Signal:
    """Return `values` with missing samples replaced by a straight line."""
    count = int(places[-1] - places[0]) + 1
    if count == len(places):
        return values
    return np.interp(np.arange(count), places - places[0], values)
