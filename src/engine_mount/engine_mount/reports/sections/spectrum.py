"""Spectra of recorded signals: averaged over overlapping windowed segments (Welch's method)."""

import math

import numpy as np

from engine_mount.reports.drawing.chart import Array

_SEGMENT = 2.048  # s, chosen: lines 0.5 Hz apart tell the modes of the car apart


def amplitude_density(values: Array, rate: float, segment: float = _SEGMENT) -> tuple[Array, Array]:
    """Return frequencies (Hz) and the one-sided amplitude spectral density (unit / sqrt(Hz)) of `values`.

    `values` are evenly spaced at `rate` (Hz) and known. The sum of its squares times the spacing of the
    frequencies is the variance. Hann window, half overlap, the mean of each segment taken off. A signal
    shorter than `segment` (s) is one segment.
    """
    if len(values) < 8:
        raise ValueError(f'a spectrum needs at least 8 samples, these are {len(values)}')
    length = min(len(values), round(segment * rate))
    window = np.hanning(length + 1)[:-1]
    begins = range(0, len(values) - length + 1, max(1, length // 2))
    power = np.zeros(length // 2 + 1)
    for begin in begins:
        piece = values[begin : begin + length]
        power += np.abs(np.fft.rfft((piece - piece.mean()) * window)) ** 2
    power *= 2.0 / (len(begins) * rate * float(np.sum(window**2)))
    return np.fft.rfftfreq(length, 1.0 / rate), np.sqrt(power)


def evenly(time: Array, values: Array, rate: float) -> tuple[Array, Array, int]:
    """Return the signal at even steps of `rate` (Hz), and how many of these samples were made up.

    Missing and unknown (NaN) samples are replaced by a straight line between those that are known.
    """
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if len(time) < 2:
        return time, values, 0
    count = math.floor((time[-1] - time[0]) * rate + 0.5) + 1
    grid = time[0] + np.arange(count) / rate
    return grid, np.interp(grid, time, values), max(0, count - len(time))
