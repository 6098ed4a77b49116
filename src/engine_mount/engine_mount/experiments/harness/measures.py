"""Figures of a displacement or an acceleration at 1 kHz that several experiments share."""

from typing import Any

import numpy as np

from engine_mount.experiments.harness.experiment import Values
from engine_mount.identification.fitting import rms
from engine_mount.reports.drive.signals import FloatArray, Truth
from engine_mount.reports.sections.periodic import Band
from mount_models.sampling import SAMPLE_TIME

FIRST_FREQUENCY, RATE = 1.0, 1.0  # Hz, Hz/s: Sec. 6
_CLEAR = 0.3  # chosen: a turning point of so much of the largest one counts as the first
_FIRST_WITHIN = 0.3  # s


def sweep_parameters(level: float, last: float, idle: float = 0.0) -> Values:
    """Return the simulator's parameters of a sweep: road level (m/s), last frequency (Hz), idle force (N)."""
    return {
        'scenario': 'sweep',
        'sweep.velocity_amplitude': level,
        'sweep.first_frequency': FIRST_FREQUENCY,
        'sweep.last_frequency': last,
        'sweep.rate': RATE,
        'idle.amplitude': idle,
    }


def swept_frequency(count: int) -> FloatArray:
    """Return the frequency (Hz) of a sweep at its first `count` samples."""
    return FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(count)


def peak_in(frequency: FloatArray, displacement: FloatArray, band: Band) -> float | None:
    """Return the largest displacement (m) while the sweep passes a band (Hz), None where it does not."""
    within = _passing(frequency, band)
    return float(np.max(np.abs(displacement[within]))) if within.any() else None


def rms_in(frequency: FloatArray, acceleration: FloatArray, band: Band) -> float | None:
    """Return the rms of the acceleration (m/s^2) while the sweep passes a band, None where it does not."""
    within = _passing(frequency, band)
    return rms(acceleration[within]) if within.any() else None


def _passing(frequency: FloatArray, band: Band) -> Any:
    """Return which samples of a sweep are in a band; none where it does not pass all of it."""
    inside = (frequency >= band[0]) & (frequency < band[1])
    return inside & (frequency[-1] >= band[1] - 0.01)


def peak_and_rms(truth: Truth, *_: Any) -> Values:
    """Return the largest displacement (m) below the isolation bands and the rms (m/s^2) in each of them."""
    frequency = swept_frequency(truth.time.size)
    return {
        'peak_m': peak_in(frequency, truth.displacement, BELOW_ISOLATION),
        'rms': [rms_in(frequency, truth.chassis_acceleration, band) for band in ISOLATION_BANDS],
    }


def highest_per_band(
    frequency: FloatArray, values: FloatArray, width: float
) -> tuple[FloatArray, FloatArray]:
    """Return the middles of bands of `width` (Hz), and the highest absolute value in each."""
    numbers = np.floor(frequency / width).astype(int)
    starts = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1))
    return (numbers[starts] + 0.5) * width, np.maximum.reduceat(np.abs(values), starts)


def first_extremum(displacement: FloatArray) -> float:
    """Return the size (m) of the first clear turning point of a displacement from the gap on."""
    part = displacement[: round(_FIRST_WITHIN / SAMPLE_TIME)]
    slope = np.diff(part)
    turning = np.flatnonzero(slope[1:] * slope[:-1] <= 0.0) + 1
    moved = np.abs(part - part[0])
    clear = turning[moved[turning] > _CLEAR * moved.max()]
    return float(np.abs(part[clear[0]])) if clear.size else float(np.abs(part).max())


BELOW_ISOLATION = (3.0, 14.0)
"""Hz: the resonance of the engine on its mounts, where the mount has to damp (Fig. 14)."""
ISOLATION_BANDS = ((14.0, 20.0), (20.0, 30.0), (30.0, 50.0))
"""Hz: damping is off there (Fig. 14); the borders are chosen."""
