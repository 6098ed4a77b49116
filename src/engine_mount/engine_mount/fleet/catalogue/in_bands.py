"""What a signal is in bands of frequency: filtered piece by piece."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from engine_mount.fleet.catalogue.band_pass import BandPass, FloatArray
from engine_mount.recordings.times import Times

_PIECE = 1 << 18  # samples, chosen


class InBand(NamedTuple):
    """Largest absolute value and rms of a signal in one band, in its unit."""

    peak: float
    rms: float


def in_bands(
    stamps: Times, values: FloatArray, rate: float, bands: Sequence[tuple[float, float]]
) -> list[InBand]:
    """Return peak and rms of a signal (n,) in each band (Hz), NaN where it is too short for one.

    The stamps (ns) rise. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    known = np.isfinite(values)
    time, values = ((stamps - stamps[:1]) * 1e-9)[known], values[known]
    count = math.floor((time[-1] - time[0]) * rate + 0.5) + 1 if len(time) > 1 else 0
    passes = [_Pass(band, rate) if count >= rate / band[0] else None for band in bands]
    for begin in range(0, count if any(passes) else 0, _PIECE):
        grid = time[0] + np.arange(begin, min(begin + _PIECE, count)) / rate
        moved = np.interp(grid, time, values) - values[0]
        for each in passes:
            if each is not None:
                each.take(moved)
    # less than one period of its lowest frequency is too short
    return [InBand(math.nan, math.nan) if each is None else each.found(count) for each in passes]


class _Pass:
    """What came through the filter of a band."""

    def __init__(self, band: tuple[float, float], rate: float):
        self._filter, self._peak, self._square = BandPass(band, rate), 0.0, 0.0

    def take(self, values: FloatArray) -> None:
        passed = self._filter.passed(values)
        self._peak = max(self._peak, float(np.abs(passed).max()))
        self._square += float(np.sum(passed**2))

    def found(self, count: int) -> InBand:
        return InBand(self._peak, math.sqrt(self._square / count))
