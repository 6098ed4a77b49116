"""The copper of the coil: its resistance, how warm its current makes it, and which current it may carry.

After switching to plus the link voltage U drives n A dB/dt = U - R i, whatever gap and core are. So over
the current this voltage is a straight line, whose slope is -R.

One thermal mass, heated by the copper loss and cooled to the ambient,

    C dT/dt = R(T) i^2 - (T - T_a) / R_th,    R(T) = R_20 (1 + alpha (T - 20 degC)),    tau = R_th C,

in which T is `celsius`, T_a `ambient_celsius`, R_th `thermal_resistance`, tau `time_constant`, R_20
`resistance` and alpha `copper`. Textbook law of a thermal body of first order (derived). A step of length
h is implicit in T and takes R at its begin: stable for any h, right to first order in h / tau, and made of
the four basic operations alone, so it gives the same bits on every processor.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from mount_models.arithmetic.sums import least_squares, mean
from mount_models.arrays import FloatArray
from mount_models.quantity import ParameterError, Quantity

COPPER_COEFFICIENT = 0.00393
"""Relative rise of the resistance of copper per kelvin at 20 degC, 1/K (IEC 60028)."""

REFERENCE_CELSIUS = 20.0
"""Temperature at which the resistance of a coil is given, degC."""


class CoilResistance(NamedTuple):
    """Resistance and its standard deviation (ohm), and the voltage of the link (V)."""

    ohm: float
    std: float
    link_voltage: float


class DriftingResistance(NamedTuple):
    """Resistance (ohm) while the voltage drifts, and by how much the medians of 20 samples scatter (V)."""

    ohm: float
    misfit: float


def resistance_at(ohm: float, celsius: float) -> float:
    """Return what a copper coil of `ohm` at 20 degC has at `celsius` (degC)."""
    return ohm * (1.0 + COPPER_COEFFICIENT * (celsius - REFERENCE_CELSIUS))


def measured_resistance(turns_area: float, current: FloatArray, flux_rate: FloatArray) -> CoilResistance:
    """Return the resistance from mean currents (A) and slopes of flux density (T/s), shape (N,), N > 2.

    `turns_area` is n A (m^2). Slopes that are not finite are left out, and after a first straight line those
    farther from it than 4 scaled median deviations.
    """
    finite = np.isfinite(current) & np.isfinite(flux_rate)
    current, voltage = current[finite], turns_area * flux_rate[finite]
    slope, intercept = _line(current, voltage)
    deviation = np.abs(voltage - intercept - slope * current)
    near = deviation <= max(_FARTHEST * float(np.median(deviation)), _ROUNDING)
    current, voltage = current[near], voltage[near]
    slope, intercept = _line(current, voltage)
    residual = voltage - intercept - slope * current
    offset = current - mean(current)
    variance = mean(residual * residual) / mean(offset * offset) / (current.size - 2)
    return CoilResistance(-slope, math.sqrt(variance), intercept)


def resistance_beside_drift(
    turns_area: float, current: FloatArray, flux_rate: FloatArray
) -> DriftingResistance:
    """Return the resistance like `measured_resistance`, of samples at equal times while the voltage drifts.

    The drift is taken for a straight line over the time, so the current (A) must not be one.
    """
    time = np.arange(current.size, dtype=float) / current.size
    finite = np.isfinite(current) & np.isfinite(flux_rate)
    time, current, voltage = time[finite], current[finite], turns_area * flux_rate[finite]
    columns = np.stack([np.ones(time.size), time, -current], axis=1)
    (link, drift, ohm), _ = least_squares(columns, voltage)
    residual = voltage - link - drift * time + ohm * current
    blocks = np.sort(residual[: residual.size // _BLOCK * _BLOCK].reshape(-1, _BLOCK), axis=1)
    medians = blocks[:, _BLOCK // 2].copy()
    return DriftingResistance(float(ohm), math.sqrt(mean(medians * medians)))


_BLOCK = 20  # samples, chosen
_FARTHEST = 4.0 * 1.4826  # of median deviations, chosen: 4 standard deviations of a normal distribution
_ROUNDING = 1e-3  # V, chosen: the resolution of readings without noise


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return slope and value at 0 of the straight line of least squares."""
    offset = x - mean(x)
    slope = mean(offset * y) / mean(offset * offset)
    return slope, mean(y) - slope * mean(x)


_FINE = 0.01  # K, chosen


class CoilHeating(NamedTuple):
    """Coil as a thermal body, and the temperatures between which its current is lowered."""

    resistance: Annotated[float, Quantity('ohm', 'resistance of the coil at 20 degC', 0.01, 100.0)] = 2.5
    copper: Annotated[
        float,
        Quantity('1/K', 'rise of the resistance per kelvin', 0.0, 0.01, 'copper, IEC 60028'),
    ] = COPPER_COEFFICIENT
    thermal_resistance: Annotated[
        float,
        Quantity('K/W', 'from coil to ambient', 0.1, 100.0, 'chosen: 1 A for ever is 20 K, 3 A is too much'),
    ] = 6.0
    time_constant: Annotated[
        float,
        Quantity('s', 'of coil and core against the ambient', 1.0, 36000.0, 'chosen: 0.26 kg of copper'),
    ] = 600.0
    ambient_celsius: Annotated[
        float, Quantity('degC', 'highest temperature around the mount', -60.0, 150.0, 'chosen: engine bay')
    ] = 80.0
    derating_celsius: Annotated[
        float, Quantity('degC', 'from here on the current is lowered', -60.0, 250.0, 'chosen')
    ] = 140.0
    limit_celsius: Annotated[
        float,
        Quantity('degC', 'here the current is 0 A', -60.0, 250.0, 'chosen: 10 K below insulation class H'),
    ] = 170.0


def warmed(heating: CoilHeating, celsius: float, mean_square: float, duration: float) -> float:
    """Return the temperature (degC) of the coil after `duration` s with this mean square current (A^2)."""
    warmth = heating.thermal_resistance * heating.resistance * mean_square  # K, at 20 degC
    share = duration / heating.time_constant
    resistance_ratio = 1.0 + heating.copper * (celsius - REFERENCE_CELSIUS)
    steady = heating.ambient_celsius + warmth * max(resistance_ratio, 0.0)
    return (celsius + share * steady) / (1.0 + share)


def highest_current(heating: CoilHeating, celsius: float, current_limit: float) -> float:
    """Return the current (A) that a coil of this temperature may carry, at most `current_limit` (A).

    It falls in a straight line from `derating_celsius` to 0 A at `limit_celsius`: smoothly, and a coil that
    only its current heats never reaches the limit.
    """
    if celsius <= heating.derating_celsius:
        return current_limit
    if celsius >= heating.limit_celsius:
        return 0.0
    span = heating.limit_celsius - heating.derating_celsius
    return current_limit * ((heating.limit_celsius - celsius) / span)


def hottest_by_current(heating: CoilHeating, current_limit: float) -> float:
    """Return the temperature (degC) at which `highest_current` keeps a coil that carries it for ever."""
    low, high = heating.ambient_celsius, heating.limit_celsius
    while high - low > _FINE:
        middle = 0.5 * (low + high)
        current = highest_current(heating, middle, current_limit)
        rises = warmed(heating, middle, current * current, 1.0) > middle
        low, high = (middle, high) if rises else (low, middle)
    return high


def check_heating(heating: CoilHeating) -> None:
    """Raise `ParameterError` unless ambient, begin of derating and limit rise in this order."""
    h = heating
    if not h.ambient_celsius < h.derating_celsius < h.limit_celsius:
        raise ParameterError(
            f'ambient_celsius ({h.ambient_celsius:g}), derating_celsius ({h.derating_celsius:g}) and '
            f'limit_celsius ({h.limit_celsius:g} degC) must rise in this order; correct them'
        )
