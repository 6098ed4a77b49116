"""A causal Butterworth band-pass, whose input comes piece by piece.

It is that of `scipy.signal` to the bit, which would take 60 MB and 0.7 s of every worker for it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled

FloatArray = NDArray[np.float64]

_ORDER = 4  # chosen: at each side of the band
_TWICE = 4.0  # twice the rate by which the bilinear transform is made; cancels


class BandPass:
    """The filter of one band (Hz), at `rate` (Hz)."""

    def __init__(self, band: tuple[float, float], rate: float):
        self._sections = sections(band, rate)
        self._state = np.zeros((len(self._sections), 2))

    def passed(self, values: FloatArray) -> FloatArray:
        """Return what passes of the values (n,) that follow."""
        passed = np.empty(len(values))
        _pass(self._sections, self._state, values, passed)
        return passed


def sections(band: tuple[float, float], rate: float) -> FloatArray:
    """Return the sections of second order, (4, 5): b0, b1, b2 and a1, a2 of each, a0 being 1.

    The poles of the low-pass are moved to the band and by the bilinear transform into the unit circle; those
    nearest to it come last. Raises a `ValueError` where the band is not below half the rate.
    """
    lower, upper = band
    if not 0.0 < lower < upper < 0.5 * rate:
        raise ValueError(f'a band must lie between 0 and half the rate, {0.5 * rate:g} Hz; it is {band}')
    begin, end = _TWICE * np.tan(np.pi * (np.array(band) / (rate / 2.0)) / 2.0)
    width, middle = end - begin, np.sqrt(begin * end)
    low = -np.exp(1j * np.pi * np.arange(1.0 - _ORDER, _ORDER, 2.0) / (2 * _ORDER)) * width / 2.0
    root = np.sqrt(low**2 - middle**2)
    poles = np.concatenate([low + root, low - root])
    gain = width**_ORDER * np.real(_TWICE**_ORDER / np.prod(_TWICE - poles))
    poles = _of_upper_half((_TWICE + poles) / (_TWICE - poles))
    found = np.empty((_ORDER, 5))
    zeros = {1.0: _ORDER // 2, -1.0: _ORDER // 2}  # twice each: those of 0 Hz and of half the rate
    for place, pole in zip(reversed(range(_ORDER)), poles, strict=True):
        zero = min((each for each, left in zeros.items() if left), key=lambda each: abs(each - pole))
        zeros[zero] -= 1
        found[place] = 1.0, -2.0 * zero, 1.0, -2.0 * pole.real, pole.real * pole.real + pole.imag * pole.imag
    found[0, :3] *= gain
    return found


def _of_upper_half(poles: NDArray[Any]) -> NDArray[Any]:
    """Return one of each conjugate pair, the nearest to the unit circle first."""
    upper, lower = (np.sort_complex(half) for half in (poles[poles.imag > 0], poles[poles.imag < 0].conj()))
    found = (upper + lower) / 2.0
    return found[np.argsort(np.abs(1.0 - np.abs(found)), kind='stable')]


@compiled
def _pass(sections, state, values, passed):
    for index in range(len(values)):
        value = values[index]
        for place in range(len(sections)):
            before = value
            value = sections[place, 0] * before + state[place, 0]
            state[place, 0] = sections[place, 1] * before - sections[place, 3] * value + state[place, 1]
            state[place, 1] = sections[place, 2] * before - sections[place, 4] * value
        passed[index] = value
