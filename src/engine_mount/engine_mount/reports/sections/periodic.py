"""Signals by frequency: sines and their harmonics, the work of a closed loop, spectra, sweeps."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_mount.reports.drawing.chart import Array
from mount_models.sampling import SAMPLE_RATE

Band = tuple[float, float]

_FADED = 0.25  # s, chosen
_SEGMENT = 2.048  # s, chosen: lines 0.5 Hz apart tell the modes of the car apart


class Sine(NamedTuple):
    """The sine that a signal resembles most: Hz, amplitude in the signal's unit, share of its variance."""

    frequency: float
    amplitude: float
    share: float


def dominant_sine(time: Array, values: Array) -> Sine:
    """Return the sine that takes most of the variance of `values` (at the evenly spaced `time`, s).

    Found in the discrete spectrum, then refined between its lines by least squares; a stretch shorter than a
    period has one too. NaN where there is no variation or are fewer than 8 samples.
    """
    from scipy.optimize import minimize_scalar  # loads long

    if len(values) < 8 or not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return Sine(math.nan, math.nan, math.nan)
    centred = values - values.mean()
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(len(centred))))
    line = 1 + np.argmax(spectrum[1:])
    spacing = 1.0 / (len(values) * np.median(np.diff(time)))
    near = (max(line - 1.5, 0.25) * spacing, (line + 1.5) * spacing)
    found = minimize_scalar(
        lambda each: _residual(time, values, each), bounds=near, method='bounded', options={'xatol': 1e-9}
    )
    frequency = float(found.x)
    amplitude = float(_amplitudes(time, values, frequency, 1)[0])
    share = 1.0 - found.fun / (centred @ centred)
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
    spacing = np.median(np.diff(time))
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


def decibels(amplitudes: Array) -> Array:
    """Return 20 log10 of `amplitudes`, NaN where one is 0."""
    return 20.0 * np.log10(np.where(amplitudes > 0.0, amplitudes, np.nan))


def amplitude_density(values: Array, rate: float) -> tuple[Array, Array]:
    """Return frequencies (Hz) and one-sided amplitude spectral density (unit / sqrt(Hz)) of `values`.

    `values` are evenly spaced at `rate` (Hz) and known. The sum of its squares times the spacing of the
    frequencies is the variance. Hann window, half overlap, the mean of each segment taken off. A signal
    shorter than a segment of 2.048 s is one segment (Welch's method).
    """
    if len(values) < 8:
        raise ValueError(f'a spectrum needs at least 8 samples, these are {len(values)}')
    from scipy.signal import welch  # loads long

    length = min(len(values), round(_SEGMENT * rate))
    frequency, power = welch(values, rate, 'hann', length)
    return frequency, np.sqrt(power)


def rms_in_bands(
    values: Array,
    bands: Sequence[Band],
    rate: float = SAMPLE_RATE,
    weighting: Callable[[Array], Array] = np.ones_like,
) -> list[float]:
    """Return the rms of what `values` (n,) at `rate` (Hz) hold in each band (Hz), in their unit.

    From one spectrum of all of it: every moment counts the same, as it does not with windows. `weighting`
    returns a gain for each frequency (Hz). NaN of a band that reaches beyond half the rate.
    """
    frequency = np.fft.rfftfreq(len(values), 1.0 / rate)
    amplitude = weighting(frequency) * np.abs(np.fft.rfft(values)) / len(values)
    found = []
    for low, high in bands:
        inside = amplitude[(frequency >= low) & (frequency < high)]
        found.append(float(np.sqrt(2.0 * np.sum(inside**2))) if high <= 0.5 * rate else math.nan)
    return found


def faded(values: Array, rate: float = SAMPLE_RATE) -> Array:
    """Return `values` (n,) at `rate` (Hz) without their mean, faded at both ends.

    A jump from the last to the first would add to all bands.
    """
    edge = np.sin(0.5 * np.pi * np.minimum(1.0, np.arange(0.5, len(values)) / (_FADED * rate)))
    return (values - values.mean()) * (edge * edge[::-1]) ** 2


def vertical_weighting(frequency: Array) -> Array:
    """Return the gain of W_k at each frequency (Hz): what people who sit feel of a vertical acceleration.

    ISO 2631-1:1997, Annex A: limits of the band, transition from acceleration to velocity, upward step.
    """

    def second_order(corner: float, quality: float) -> Any:
        return 1.0 + s / (quality * corner) + (s / corner) ** 2

    s = 1j * frequency  # over 2 pi, as the corners are in Hz
    limits = (s / 0.4) ** 2 / second_order(0.4, math.sqrt(0.5)) / second_order(100.0, math.sqrt(0.5))
    transition = (1.0 + s / 12.5) / second_order(12.5, 0.63)
    step = (2.37 / 3.35) ** 2 * second_order(2.37, 0.91) / second_order(3.35, 0.91)
    return np.abs(limits * transition * step)


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
