"""What displacement alone tells of engine and pads: estimators, tried on plants that are known."""

import numpy as np

from engine_mount.reports.drive.signals import FloatArray
from mount_models.sampling import SAMPLE_TIME

BAND = (4.0, 14.0)  # Hz: where the engine may shake
_SMOOTH = 30.0  # Hz, chosen: above it no derivative is taken
_RINGING = (0.06, 0.45)  # s behind the gap: the first extremum is past, the ringing not
_MASS = 80.0  # kg: the share of the engine that the estimate believes in


def frequency_in_band(displacement: FloatArray) -> float:
    """Return the rms velocity over the rms displacement (Hz) within `BAND`: how fast the phasor turns."""
    spectrum, frequency = _spectrum(displacement)
    within = (frequency >= BAND[0]) & (frequency <= BAND[1])
    power = np.abs(spectrum[within]) ** 2
    return float(np.sqrt(np.sum(power * frequency[within] ** 2) / np.sum(power)))


def friction_scale(displacement: FloatArray, assumed_force: FloatArray) -> float:
    """Return the pads' friction over the `assumed_force` (N), from the ringing behind a gap at sample 0.

    Least squares of acceleration over displacement, velocity, assumed force and a constant.
    """
    first, last = (round(edge / SAMPLE_TIME) for edge in _RINGING)
    part = slice(first, last)
    columns = [_derivative(displacement, 0), _derivative(displacement, 1), _derivative(assumed_force, 0)]
    base = np.stack([*(column[part] for column in columns), np.ones(last - first)], 1)
    solution = np.linalg.lstsq(base, _derivative(displacement, 2)[part], rcond=None)[0]
    return float(-_MASS * solution[2])


def _derivative(values: FloatArray, order: int) -> FloatArray:
    spectrum, frequency = _spectrum(values)
    spectrum[frequency > _SMOOTH] = 0.0
    return np.asarray(np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, values.size), np.float64)


def _spectrum(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.fft.rfft(values), np.fft.rfftfreq(values.size, SAMPLE_TIME)
