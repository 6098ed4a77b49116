"""By how much one signal is later than another, from their cross-correlation.

The transform is numpy's. `scipy.signal` has the correlation and its peaks too, but not the energy of what
overlaps at each shift, and nothing of the car needs scipy.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Signal = NDArray[np.float64]

LONGEST = 0.5  # s, chosen: lags are looked for up to this
_LEAST_SAMPLES = 64  # chosen
_LEAST_CORRELATION = 0.8  # chosen: below, the shapes are not the same and a lag means nothing
_AS_GOOD = 0.99  # of the highest correlation, chosen: then the shorter lag is the answer
_EXPLAINED = 0.5  # chosen: of what remains unlike without a shift, a lag must take away so much
_IN_STEP = 0.1  # samples, chosen: a shorter lag is none and need not explain anything


@dataclass(frozen=True)
class Lag:
    """`seconds` by which the second signal is later, NaN where it cannot be told; `remark` says why."""

    seconds: float
    remark: str = ''

    @property
    def known(self) -> bool:
        """Whether a lag could be told."""
        return not math.isnan(self.seconds)


def lag(a: Signal, b: Signal, period: float) -> Lag:
    """Return by how much `b` is later than `a`, both sampled every `period` (s) from the same time on.

    The lag is that of the highest correlation coefficient within half a second and a quarter of the length,
    refined below one sample by a parabola. Where several lags are as good, as with a periodic signal, it
    is the shortest. A lag that does not make the signals clearly more alike is not told: they differ
    otherwise. NaNs count as the mean.
    """
    one, other = _centred(a), _centred(b)
    if len(one) < _LEAST_SAMPLES:
        return Lag(math.nan, f'{len(one)} samples are too few for a lag')
    constant = [name for name, signal in (('A', one), ('B', other)) if not signal.any()]
    if constant:
        return Lag(math.nan, f'constant in {" and ".join(constant)}: no lag can be told')
    reach = max(1, min(round(LONGEST / period), len(one) // 4))
    correlation = _correlation(one, other, reach)
    peaks = _peaks(correlation)
    highest = float(correlation.max())
    if highest < _LEAST_CORRELATION:
        return Lag(math.nan, f'the shapes differ too much for a lag (correlation {max(0.0, highest):.2f})')
    good = peaks[correlation[peaks] >= _AS_GOOD * highest]
    if not len(good):
        return Lag(math.nan, f'no lag within {1e3 * reach * period:g} ms')
    good = good[np.argsort(np.abs(good - reach), kind='stable')]
    shift, alike = _vertex(correlation, int(good[0]))
    shift += good[0] - reach
    if abs(shift) > _IN_STEP and 1.0 - alike > (1.0 - _EXPLAINED) * (1.0 - correlation[reach]):
        return Lag(math.nan, 'no shift in time explains the difference')
    others = np.abs(np.diff(np.sort(good)))
    remark = (
        f'or whole periods of {1e3 * period * float(np.median(others)):.0f} ms more' if len(others) else ''
    )
    return Lag(float(shift) * period, remark)


def _centred(signal: Signal) -> Signal:
    known = np.isfinite(signal)
    if not known.any():
        return np.zeros(len(signal))
    values = signal[known]
    if (values == values[0]).all():
        return np.zeros(len(signal))  # else rounding of the mean would make a signal of a constant
    return np.where(known, signal - values.mean(), 0.0)


def _correlation(a: Signal, b: Signal, reach: int) -> Signal:
    """Return the correlation coefficients of `a[i]` and `b[i + k]` for k from -reach to reach."""
    count = len(a)
    size = 1 << (count + reach).bit_length()
    products = np.fft.irfft(np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size), size)
    shifts = np.arange(-reach, reach + 1)
    # Energy of what overlaps at each shift, so that a shift does not lower the coefficient by itself.
    energy_a, energy_b = (np.concatenate([[0.0], np.cumsum(signal**2)]) for signal in (a, b))
    begin, end = np.maximum(0, -shifts), count - np.maximum(0, shifts)
    energies = (energy_a[end] - energy_a[begin]) * (energy_b[end + shifts] - energy_b[begin + shifts])
    least = (
        1e-6 * float(np.sqrt(energy_a[-1] * energy_b[-1]))
    ) ** 2  # an overlap without signal says nothing
    return np.where(energies > least, products[shifts] / np.sqrt(np.maximum(energies, least)), 0.0)


def _peaks(correlation: Signal) -> NDArray[np.int64]:
    inner = correlation[1:-1]
    return 1 + np.flatnonzero((inner >= correlation[:-2]) & (inner > correlation[2:]))


def _vertex(correlation: Signal, place: int) -> tuple[float, float]:
    """Return where the parabola through `place` and its neighbours is highest (samples) and how high."""
    before, at, after = correlation[place - 1 : place + 2].tolist()
    bend = before - 2.0 * at + after
    if not bend < 0.0:
        return 0.0, at
    slope = 0.5 * (after - before)
    return -slope / bend, at - 0.5 * slope**2 / bend
