"""A magnet without saturation, F = (i / R)^2 with R a parabola over the gap, and what no magnet does."""

import numpy as np
from numpy.polynomial.polynomial import polyfit

from engine_mount.identification.fitting import FloatArray

_STRONG = 0.1  # of the median force, chosen: there noise moves a root little
_DEGREE = 12  # chosen: 1 / R^2 to 0.1 % where the largest R is six times the smallest


def unsaturated_parabola(
    gap: FloatArray, current: FloatArray, force: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return F / i^2 = 1 / R^2 over the gap (-1 .. 1): coefficients, lowest power first, and covariance."""
    strong = (force > _STRONG * np.median(force)) & (current > 0.0)
    current, force = current[strong], force[strong]
    weights = force**1.5 / (current * tolerance[strong])  # misfits of the root count as those of the force
    fitted, covariance = np.polyfit(gap[strong], current / np.sqrt(force), 2, w=weights, cov=True)
    nodes = np.cos(np.linspace(0.0, np.pi, 8 * _DEGREE))
    reluctance = np.polyval(fitted, nodes)
    slopes = -2.0 * np.vander(nodes, 3) / reluctance[:, np.newaxis] ** 3
    columns = np.column_stack([reluctance**-2, slopes])
    parabola, *carried = polyfit(nodes, columns, _DEGREE, w=reluctance**2).T
    return parabola, np.transpose(carried) @ covariance @ carried


def shortfall(force: FloatArray, unsaturated: FloatArray) -> FloatArray:
    """Return how far rises with the current and falls with the gap miss a margin, 0 or less each.

    The forces (N), (gaps, currents from 0 A on), are compared with those without saturation.
    """
    rises = np.diff(force) / unsaturated[:, 1:]
    falls = -np.diff(force, axis=0)[:, 1:] / unsaturated[:-1, 1:]
    return np.minimum(np.append(rises, falls) - 3e-5, 0.0)  # chosen, of the force without saturation
