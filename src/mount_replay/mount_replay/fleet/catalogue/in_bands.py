"""What a signal is in bands of frequency: filtered piece by piece, so that its length costs no memory."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_ORDER = 4  # chosen: of the Butterworth filter at each side of a band
_PIECE = 1 << 18  # samples, chosen


class InBand(NamedTuple):
    """Largest absolute value and rms of a signal in one band, in its unit."""

    peak: float
    rms: float


def in_bands(
    time: FloatArray, values: FloatArray, rate: float, bands: Sequence[tuple[float, float]]
) -> list[InBand]:
    """Return peak and rms of a signal (n,) in each band (Hz), NaN where it is too short for one.

    `time` (s) rises. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    from scipy import signal

    known = np.isfinite(values)
    if not known.all():
        time, values = time[known], values[known]
    count = math.floor((time[-1] - time[0]) * rate + 0.5) + 1 if len(time) > 1 else 0
    found = []
    for low, high in bands:
        if count < rate / low:  # less than one period of its lowest frequency
            found.append(InBand(math.nan, math.nan))
            continue
        sections = signal.butter(_ORDER, (low, high), 'bandpass', fs=rate, output='sos')
        state, peak, square = np.zeros((len(sections), 2)), 0.0, 0.0
        for begin in range(0, count, _PIECE):
            grid = time[0] + np.arange(begin, min(begin + _PIECE, count)) / rate
            passed, state = signal.sosfilt(sections, np.interp(grid, time, values) - values[0], zi=state)
            peak, square = max(peak, float(np.abs(passed).max())), square + float(np.sum(passed**2))
        found.append(InBand(peak, math.sqrt(square / count)))
    return found
