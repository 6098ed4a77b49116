"""The resistance of the coil: from the ripple, and what it is to be at a temperature.

After switching to plus the link voltage U drives n A dB/dt = U - R i, whatever gap and core are. So over
the current this voltage is a straight line, whose slope is -R.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.averages import mean
from mount_models.arithmetic.least_squares import least_squares

COPPER_COEFFICIENT = 0.00393
"""Relative rise of the resistance of copper per kelvin at 20 degC, 1/K (IEC 60028)."""

REFERENCE_CELSIUS = 20.0
"""Temperature at which the resistance of a coil is given, degC."""

FloatArray = npt.NDArray[np.float64]


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
