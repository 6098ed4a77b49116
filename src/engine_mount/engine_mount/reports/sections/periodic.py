"""Periodic signals: their frequency, their harmonics, the work of a closed loop."""

import math
from dataclasses import dataclass

import numpy as np

from engine_mount.reports.drawing.chart import Array

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_STEPS = 40  # of the search: the bracket shrinks to 5e-9 of itself


@dataclass(frozen=True)
class Sine:
    """The sine that a signal resembles most: Hz, amplitude in the signal's unit, share of its variance."""

    frequency: float
    amplitude: float
    share: float


def dominant_sine(time: Array, values: Array) -> Sine:
    """Return the sine that takes most of the variance of `values` (at the evenly spaced `time`, s).

    Found in the discrete spectrum, then refined between its lines by least squares; a stretch shorter than a
    period has one too. NaN where there is no variation or are fewer than 8 samples.
    """
    if len(values) < 8 or not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return Sine(math.nan, math.nan, math.nan)
    centred = values - values.mean()
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(len(centred))))
    line = 1 + int(np.argmax(spectrum[1:]))
    spacing = 1.0 / (len(values) * float(np.median(np.diff(time))))
    low, high = max(line - 1.5, 0.25) * spacing, (line + 1.5) * spacing
    for _ in range(_STEPS):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if _residual(time, values, left) < _residual(time, values, right):
            high = right
        else:
            low = left
    frequency = 0.5 * (low + high)
    amplitude = float(_amplitudes(time, values, frequency, 1)[0])
    share = 1.0 - _residual(time, values, frequency) / float(centred @ centred)
    return Sine(frequency, amplitude, share)


def harmonics(time: Array, values: Array, frequency: float, count: int = 8) -> Array:
    """Return the amplitudes of harmonics 1 to `count` of `values` at `frequency` (Hz), in their unit.

    By least squares, so the stretch need not hold whole periods; it must hold two.
    """
    if not (time[-1] - time[0]) * frequency >= 2.0 - 1e-9:
        raise ValueError(
            f'harmonics of {frequency:.4g} Hz need two periods; {time[-1] - time[0]:.4g} s were given'
        )
    return _amplitudes(time, values, frequency, count)


def distortion(amplitudes: Array) -> float:
    """Return the total harmonic distortion: the rms of all higher harmonics over the first."""
    return float(np.sqrt(np.sum(amplitudes[1:] ** 2)) / amplitudes[0]) if amplitudes[0] > 0.0 else math.nan


def whole_periods(time: Array, frequency: float, most: int) -> tuple[slice, int]:
    """Return the last whole periods of `frequency` (Hz) in `time`, at most so many, and their number.

    The slice holds both ends of the stretch, so that a loop over it closes.
    """
    spacing = float(np.median(np.diff(time)))
    periods = min(most, int((time[-1] - time[0]) * frequency + 1e-6))
    samples = round(periods / (frequency * spacing))
    return slice(len(time) - 1 - samples, len(time)), periods


def cycle_work(displacement: Array, force: Array, periods: int) -> float:
    """Return the work (J) per period that `force` (N) does along `displacement` (m) over whole `periods`.

    Positive is dissipated where the force resists. Between samples the force is taken as straight in the
    displacement.
    """
    steps = np.diff(displacement)
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * steps)) / periods


def _amplitudes(time: Array, values: Array, frequency: float, count: int) -> Array:
    solution = np.linalg.lstsq(_base(time, frequency, count), values, rcond=None)[0]
    return np.hypot(solution[1::2], solution[2::2])


def _residual(time: Array, values: Array, frequency: float) -> float:
    base = _base(time, frequency, 1)
    rest = values - base @ np.linalg.lstsq(base, values, rcond=None)[0]
    return float(rest @ rest)


def _base(time: Array, frequency: float, count: int) -> Array:
    angle = 2.0 * math.pi * frequency * (time - time[0])
    columns = [np.ones_like(angle)]
    for number in range(1, count + 1):
        columns += [np.cos(number * angle), np.sin(number * angle)]
    return np.column_stack(columns)
