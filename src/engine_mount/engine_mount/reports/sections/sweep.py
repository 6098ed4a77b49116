"""Excitations whose frequency passes through a range: which frequency when, and what the mount does in it."""

from dataclasses import dataclass

import numpy as np

from engine_mount.reports.drawing.chart import Array

_LEAST_PERIODS = 20  # chosen
_LEAST_RATIO = 3.0  # chosen: of the highest to the lowest frequency of a sweep
_STRAIGHTNESS = 0.05  # chosen: rms distance of the frequencies from a straight line, of their range


@dataclass(frozen=True)
class Sweep:
    """The frequency (Hz) of an excitation at some moments (s), both rising."""

    time: Array
    frequency: Array

    def at(self, time: Array) -> Array:
        """Return the frequency at `time`, NaN outside of the sweep."""
        return np.interp(time, self.time, self.frequency, left=np.nan, right=np.nan)


def find_sweep(time: Array, excitation: Array) -> Sweep | None:
    """Return the sweep that `excitation` is, None if it is none.

    The frequency of each period is that between its rises through zero. It counts as a sweep if these
    frequencies lie near a rising straight line and pass through at least a factor of 3.
    """
    crossings = _rises(time, excitation)
    if len(crossings) <= _LEAST_PERIODS:
        return None
    middle, frequency = 0.5 * (crossings[1:] + crossings[:-1]), 1.0 / np.diff(crossings)
    line = np.polyval(np.polyfit(middle, frequency, 1), middle)
    spread = float(np.ptp(line))
    if line[0] <= 0.0 or line[-1] < _LEAST_RATIO * line[0]:
        return None
    if np.sqrt(np.mean((frequency - line) ** 2)) > _STRAIGHTNESS * spread:
        return None
    return Sweep(middle, np.maximum.accumulate(frequency))


def peak_per_band(frequency: Array, values: Array, width: float = 1.0) -> tuple[Array, Array]:
    """Return the lower edges of the bands of `width` (Hz) and the highest absolute value in each.

    `frequency` is that of the excitation at each sample; samples where it is unknown do not count, nor do
    unknown values. Bands without a sample are left out.
    """
    edges, groups = _bands(frequency, values, width)
    return edges, np.array([np.max(np.abs(group)) for group in groups])


def rms_per_band(frequency: Array, values: Array, width: float = 1.0) -> tuple[Array, Array]:
    """Return the same with the rms of the values, their mean over the band included."""
    edges, groups = _bands(frequency, values, width)
    return edges, np.array([np.sqrt(np.mean(group**2)) for group in groups])


def _bands(frequency: Array, values: Array, width: float) -> tuple[Array, list[Array]]:
    known = np.isfinite(frequency) & np.isfinite(values)
    numbers = np.floor(frequency[known] / width + 1e-9).astype(int)
    inside = values[known]
    bands = np.unique(numbers)
    return bands * width, [inside[numbers == band] for band in bands]


def _rises(time: Array, values: Array) -> Array:
    """Return when `values` pass zero upwards, between samples by a straight line."""
    known = np.isfinite(values)
    time, values = time[known], values[known]
    before = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    step = values[before + 1] - values[before]
    return time[before] - values[before] / step * (time[before + 1] - time[before])
