"""Peak and rms of a signal in bands of frequency."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_ORDER = 4  # chosen: at each side of the band


class InBand(NamedTuple):
    """Largest absolute value and rms of a signal in one band, in its unit."""

    peak: float
    rms: float


def in_bands(
    stamps: NDArray[np.int64], values: FloatArray, rate: float, bands: Sequence[tuple[float, float]]
) -> list[InBand]:
    """Return peak and rms of a signal (n,) in each band (Hz), NaN where it is too short for one.

    The stamps (ns) rise. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    from scipy import signal  # takes 0.7 s to load

    known = np.isfinite(values)
    time, values = ((stamps - stamps[:1]) * 1e-9)[known], values[known]
    count = math.floor((time[-1] - time[0]) * rate + 0.5) + 1 if len(time) > 1 else 0
    found = [InBand(math.nan, math.nan)] * len(bands)
    if count:
        moved = np.interp(time[0] + np.arange(count) / rate, time, values) - values[0]
    for place, band in enumerate(bands):
        if count >= rate / band[0] > 0.0:  # less than one period of its lowest frequency is too short
            sections = signal.butter(_ORDER, band, 'bandpass', fs=rate, output='sos')
            passed = signal.sosfilt(sections, moved)
            found[place] = InBand(float(np.abs(passed).max()), math.sqrt(float(np.mean(passed**2))))
    return found
