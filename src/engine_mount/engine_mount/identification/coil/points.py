"""What ripple recorded at one known gap shows: inductance at the rest current, current of the crossing.

Of a table of few points per gap, between the points stands a monotone cubic (Fritsch, Carlson, SIAM J. Numer.
Anal. 17, 1980), which does not swing over them. How far it may be off is judged by the points themselves:
each is predicted by the others.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from engine_mount.identification.fitting import FloatArray
from mount_models.coil.crossing import CrossingError, find_crossing
from mount_models.quantity import LawRefusedError

MOST_POINTS = 200
"""Samples up to which a recording counts as a table (chosen): a ramp of 1 s at 1 kHz has 1000."""
FEWEST_CURRENTS = 5
"""Different currents of a table (chosen): three to determine a curve, two to judge it."""
_SAME_CURRENT = 1e-3  # A, chosen: readings of one current
_OF_LEFT_OUT = 0.25
"""Share of the error of a left-out point that counts between points (chosen): without it they are twice as
far apart, and an interpolation of second order errs by the square."""
_STEPS = 20  # chosen: enough to see rise and fall
_FEWEST_AT_REST = 20  # chosen
_REST_HALF_WIDTH = 0.02  # A, chosen: there the inductance is straight over the current


@dataclass(frozen=True)
class RippleRecording:
    """Ripple at one gap (m) and coil temperature (degC): currents (A) and inductances (H), shape (N,)."""

    name: str
    gap: float
    celsius: float
    current: FloatArray
    inductance: FloatArray

    def finite(self) -> tuple[FloatArray, FloatArray]:
        """Return currents and inductances where both are numbers."""
        known = np.isfinite(self.current) & np.isfinite(self.inductance)
        return self.current[known], self.inductance[known]


@dataclass(frozen=True)
class GapPoint:
    """One recording: L_0.2 (H) and i_20 (A) with standard deviations, dL/di at the crossing (H/A).

    `table` is the range of currents (A) of a table of few points that it was interpolated from.
    """

    name: str
    gap: float
    celsius: float
    inductance: float
    inductance_std: float
    crossing_current: float
    crossing_std: float
    crossing_slope: float
    table: tuple[float, float] | None = None


class InductanceTable:
    """Currents (A), rising, and inductances (H) at one gap; readings of one current are averaged."""

    def __init__(self, recording: RippleRecording):
        """Interpolate the finite samples; raises `LawRefusedError` for too few currents."""
        self.name = recording.name
        current, inductance = recording.finite()
        order = np.argsort(current, kind='stable')
        groups = np.split(order, np.flatnonzero(np.diff(current[order]) > _SAME_CURRENT) + 1)
        self.current, self.inductance = (
            np.array([values[group].mean() for group in groups if group.size])
            for values in (current, inductance)
        )
        size = self.current.size
        if size < FEWEST_CURRENTS:
            raise LawRefusedError(
                f'{self.name}: {size} different currents, at least {FEWEST_CURRENTS} are needed; measure more'
            )
        self._curve = PchipInterpolator(self.current, self.inductance)
        self._errors = np.full(size, math.nan)
        for place in range(1, size - 1):
            others = np.arange(size) != place
            without = PchipInterpolator(self.current[others], self.inductance[others])
            self._errors[place] = abs(float(without(self.current[place])) - self.inductance[place])

    def at(self, current: float) -> tuple[float, float]:
        """Return inductance (H) and its deviation at a current (A); raises `LawRefusedError` beyond."""
        low, high = self.current[[0, -1]].tolist()
        if not low - _SAME_CURRENT <= current <= high + _SAME_CURRENT:
            raise LawRefusedError(
                f'{self.name}: was measured from {low:.2f} to {high:.2f} A only, {current:.2f} A is not '
                'among it; choose a current from there, or measure further'
            )
        inside = min(max(current, low), high)
        return float(self._curve(inside)), self._deviation(inside)

    def falls_through(self, level: float) -> tuple[float, float, float]:
        """Return the current (A) at which it falls through `level` (H), its deviation, and dL/di (H/A) there.

        The fall counts behind the largest inductance, for that of some coils rises first. Raises
        `LawRefusedError` where it does not fall through, or not once and for all.
        """
        below = self.inductance < level
        peak = int(np.argmax(self.inductance))
        first = peak + int(np.argmax(below[peak:]))
        current = math.nan
        if first > peak and below[first:].all():
            current = brentq(lambda i: self._curve(i) - level, *self.current[[first - 1, first]])
        slope = float(self._curve(current, 1))
        if not slope < 0.0:
            raise LawRefusedError(f'{self.name}: {falling_sentence(self.current, self.inductance, level)}')
        return current, self._deviation(current) / -slope, slope

    def _deviation(self, current: float) -> float:
        """Return the deviation (H) around a current (A), by how well the points there predict each other."""
        place = int(np.searchsorted(self.current, current))
        around = self._errors[max(place - 1, 0) : place + 1]
        known = around[np.isfinite(around)]
        return _OF_LEFT_OUT * float(known.max() if known.size else np.nanmax(self._errors))


def measured_point(
    recording: RippleRecording,
    rest_current: float = 0.2,
    crossing_inductance: float = 20e-3,
    crossing_half_width: float = 0.2,
) -> GapPoint:
    """Return L_0.2 and i_20 of one recording; raises `LawRefusedError` naming it."""
    what = recording.name, recording.gap, recording.celsius
    current, inductance = recording.finite()
    near = np.abs(current - rest_current) <= _REST_HALF_WIDTH
    if current.size <= MOST_POINTS and near.sum() < _FEWEST_AT_REST:
        table = InductanceTable(recording)
        reach = float(table.current[0]), float(table.current[-1])
        return GapPoint(
            *what, *table.at(rest_current), *table.falls_through(crossing_inductance), table=reach
        )
    if near.sum() < _FEWEST_AT_REST:
        raise LawRefusedError(
            f'{recording.name}: samples within {_REST_HALF_WIDTH:.2f} A of the rest current '
            f'({rest_current:.2f} A) must be at least {_FEWEST_AT_REST}, {int(near.sum())} are; hold that '
            'current for longer'
        )
    at_rest = _rest_inductance((current[near] - rest_current) / _REST_HALF_WIDTH, inductance[near])
    try:
        crossing = find_crossing(
            recording.current, recording.inductance, crossing_inductance, crossing_half_width
        )
    except CrossingError as error:
        order = np.argsort(current, kind='stable')
        parts = np.array_split(order, min(_STEPS, order.size))
        i, mean = (np.array([values[part].mean() for part in parts]) for values in (current, inductance))
        within = mean.min() <= crossing_inductance <= mean.max()
        sentence = error if within else falling_sentence(i, mean, crossing_inductance)
        raise LawRefusedError(f'{recording.name}: {sentence}') from error
    return GapPoint(*what, *at_rest, crossing.current, crossing.current_std, crossing.inductance_slope)


def falling_sentence(current: FloatArray, inductance: FloatArray, level: float) -> str:
    """Return why an inductance (H) over rising currents (A) does not fall through `level` (H)."""
    peak, mh = int(np.argmax(inductance)), 1e3 * inductance
    start = f'coil inductance must fall through {level * 1e3:.1f} mH; instead it '
    if peak >= current.size - 2:
        return start + (
            f'rises with the current, from {mh[0]:.1f} mH at {current[0]:.2f} A to {mh[peak]:.1f} mH at '
            f'{current[peak]:.2f} A: the gap at contact follows from where it falls as the iron saturates, '
            'which this coil does not reach; measure up to higher currents'
        )
    if inductance[peak:].min() < level < inductance[peak]:
        return start + (
            f'crosses it several times between {current[peak]:.2f} and {current[-1]:.2f} A, as by noise or a '
            'wrong point: measure again, or choose another --crossing-inductance'
        )
    return start + (
        f'falls from {mh[peak]:.1f} mH at {current[peak]:.2f} A to {mh[-1]:.1f} mH at {current[-1]:.2f} A: '
        'choose a --crossing-inductance from there, or measure up to higher currents'
    )


def _rest_inductance(z: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Return the inductance (H) at the rest current and its std: a line through the samples around it."""
    deviation = np.abs(values - np.median(values))
    kept = deviation <= max(4.0 * 1.4826 * float(np.median(deviation)), 0.02 * abs(float(np.median(values))))
    z, values = z[kept], values[kept]
    powers = np.stack([np.ones_like(z), z], axis=1)
    if np.ptp(z) < 0.1:
        powers = powers[:, :1]  # the current was held: nothing to be said of a slope
    solution, *_ = np.linalg.lstsq(powers, values, rcond=None)
    scatter = float(np.sum((values - powers @ solution) ** 2)) / max(1, values.size - powers.shape[1])
    spread = float(np.linalg.inv(powers.T @ powers)[0, 0])
    return float(solution[0]), math.sqrt(scatter * spread)
