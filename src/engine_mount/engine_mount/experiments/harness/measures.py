"""Figures of a displacement or an acceleration at 1 kHz that several experiments share."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.experiments.harness.contract import Values
from engine_mount.reports.drive.signals import FloatArray
from mount_models.sampling import SAMPLE_TIME

Band = tuple[float, float]
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


def peak_in(frequency: FloatArray, displacement: FloatArray, band: Band) -> float | None:
    """Return the largest displacement (m) while the sweep passes a band (Hz), None where it does not."""
    within = _passing(frequency, band)
    return float(np.max(np.abs(displacement[within]))) if within.any() else None


def rms_in(frequency: FloatArray, acceleration: FloatArray, band: Band) -> float | None:
    """Return the rms of the acceleration (m/s^2) while the sweep passes a band, None where it does not."""
    within = _passing(frequency, band)
    return float(np.sqrt(np.mean(acceleration[within] ** 2))) if within.any() else None


def _passing(frequency: FloatArray, band: Band) -> NDArray[np.bool_]:
    """Return which samples of a sweep are in a band; none where it does not pass all of it."""
    inside = (frequency >= band[0]) & (frequency < band[1])
    return inside & (frequency[-1] >= band[1] - 0.01)


def peak_and_rms(displacement: FloatArray, acceleration: FloatArray) -> Values:
    """Return the largest displacement (m) below the isolation bands and the rms (m/s^2) in each of them.

    Both (n,) at 1 kHz from the begin of the sweep.
    """
    frequency = FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(displacement.size)
    return {
        'peak_m': peak_in(frequency, displacement, BELOW_ISOLATION),
        'rms': [rms_in(frequency, acceleration, band) for band in ISOLATION_BANDS],
    }


def rms_in_bands(values: FloatArray, bands: Sequence[Band]) -> list[float]:
    """Return the rms of what `values` (n,) at 1 kHz hold in each band (Hz), in their unit.

    From one spectrum of all of it: every moment counts the same, as it does not with windows.
    """
    amplitude = np.abs(np.fft.rfft(values)) / len(values)
    frequency = np.fft.rfftfreq(len(values), SAMPLE_TIME)
    inside = [(frequency >= low) & (frequency < high) for low, high in bands]
    return [float(np.sqrt(2.0 * np.sum(amplitude[band] ** 2))) for band in inside]


def first_extremum(displacement: FloatArray) -> float:
    """Return the size (m) of the first clear turning point of a displacement from the gap on."""
    part = displacement[: round(_FIRST_WITHIN / SAMPLE_TIME)]
    slope = np.diff(part)
    turning = np.flatnonzero(slope[1:] * slope[:-1] <= 0.0) + 1
    moved = np.abs(part - part[0])
    clear = turning[moved[turning] > _CLEAR * moved.max()]
    return float(np.abs(part[clear[0]])) if clear.size else float(np.abs(part).max())
