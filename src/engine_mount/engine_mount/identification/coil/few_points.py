"""Inductance over current from a table of few points per gap: interpolated, with what that leaves open.

Between the points stands a monotone cubic (Fritsch, Carlson, SIAM J. Numer. Anal. 17, 1980), which does not
swing over them. How far it may be off is told by the points themselves: each is predicted by the others.
"""

import math

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

MOST_POINTS = 200
"""Samples up to which a recording counts as a table (chosen): a ramp of 1 s at 1 kHz has 1000."""
FEWEST_CURRENTS = 5
"""Different currents of a table (chosen): three to tell a curve, two to judge it."""
_SAME_CURRENT = 1e-3  # A, chosen: readings of one current
_OF_LEFT_OUT = 0.25
"""Share of the error of a left-out point that counts between points (chosen): without it they are twice as
far apart, and an interpolation of second order errs by the square."""


class TableError(ValueError):
    """A table of few points does not tell what is asked of it; the text says value, limit and remedy."""


class InductanceTable:
    """Currents (A), rising, and inductances (H) at one gap; readings of one current are averaged."""

    def __init__(self, current: FloatArray, inductance: FloatArray):
        """Take finite samples, (n,) each, in any order; raises `TableError` for too few currents."""
        from scipy.interpolate import PchipInterpolator  # loads long

        order = np.argsort(current, kind='stable')
        groups = np.split(order, np.flatnonzero(np.diff(current[order]) > _SAME_CURRENT) + 1)
        self.current = np.array([current[group].mean() for group in groups if group.size])
        self.inductance = np.array([inductance[group].mean() for group in groups if group.size])
        if self.current.size < FEWEST_CURRENTS:
            raise TableError(
                f'{self.current.size} different currents, at least {FEWEST_CURRENTS} are needed; measure more'
            )
        self._curve = PchipInterpolator(self.current, self.inductance)
        self._errors = np.full(self.current.size, math.nan)
        for place in range(1, self.current.size - 1):
            others = np.arange(self.current.size) != place
            without = PchipInterpolator(self.current[others], self.inductance[others])
            self._errors[place] = abs(float(without(self.current[place])) - self.inductance[place])

    def at(self, current: float) -> tuple[float, float]:
        """Return inductance (H) and its deviation at a current (A); raises `TableError` beyond the points."""
        low, high = float(self.current[0]), float(self.current[-1])
        if not low - _SAME_CURRENT <= current <= high + _SAME_CURRENT:
            raise TableError(
                f'was measured from {low:.2f} to {high:.2f} A only, {current:.2f} A is not among it; '
                'choose a '
                'current from there, or measure further'
            )
        inside = min(max(current, low), high)
        return float(self._curve(inside)), self._deviation(inside)

    def falls_through(self, level: float) -> tuple[float, float, float]:
        """Return the current (A) at which it falls through `level` (H), its deviation, and dL/di (H/A) there.

        Looked for behind the largest inductance: a coil whose inductance rises first counts where it falls.
        Raises `TableError` where it does not, or not once and for all.
        """
        below = self.inductance < level
        behind = int(np.argmax(self.inductance))
        places = behind + np.flatnonzero(below[behind:])
        if not places.size or below[behind] or not below[places[0] :].all():
            raise TableError(falling_sentence(self.current, self.inductance, level))
        last = int(places[0])
        low, high = float(self.current[last - 1]), float(self.current[last])
        for _ in range(60):  # halves the bracket to the last bit
            middle = 0.5 * (low + high)
            low, high = (middle, high) if float(self._curve(middle)) > level else (low, middle)
        slope = float(self._curve(high, 1))
        if not slope < 0.0:
            raise TableError(falling_sentence(self.current, self.inductance, level))
        return high, self._deviation(high) / -slope, slope

    def _deviation(self, current: float) -> float:
        """Return the deviation (H) around a current (A), by how well the points there predict each other."""
        place = int(np.searchsorted(self.current, current))
        around = self._errors[max(place - 1, 0) : place + 1]
        known = around[np.isfinite(around)]
        return _OF_LEFT_OUT * float(known.max() if known.size else np.nanmax(self._errors))


def falling_sentence(current: FloatArray, inductance: FloatArray, level: float) -> str:
    """Return why an inductance (H) over rising currents (A) does not fall through `level` (H)."""
    peak = int(np.argmax(inductance))
    at, most, last = current[peak], inductance[peak] * 1e3, inductance[-1] * 1e3
    told = f'coil inductance must fall through {level * 1e3:.1f} mH; instead it '
    if peak >= current.size - 2:
        return told + (
            f'rises with the current, from {inductance[0] * 1e3:.1f} mH at {current[0]:.2f} A to '
            f'{most:.1f} mH '
            f'at {at:.2f} A: the gap at contact is told by where it falls as the iron saturates, which this '
            'coil does not reach; measure up to higher currents'
        )
    lowest = float(inductance[peak:].min()) * 1e3
    if lowest < level * 1e3 < most:
        return told + (
            f'crosses it several times between {at:.2f} and {current[-1]:.2f} A, as by noise or a wrong '
            'point: '
            'measure again, or choose another --crossing-inductance'
        )
    return told + (
        f'falls from {most:.1f} mH at {at:.2f} A to {last:.1f} mH at {current[-1]:.2f} A: choose a '
        '--crossing-inductance from there, or measure up to higher currents'
    )


def levels_of_all(recordings: list[tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """Return the inductances (H) between which all (currents, inductances) fall; low above high: none."""
    low = max(float(inductance[-1]) for _, inductance in recordings)
    return low, min(float(inductance.max()) for _, inductance in recordings)
