"""Fit the force law (Eqs 3, 4) to measured forces, as the authors did for Table 1."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial
from scipy.optimize import least_squares

from mount_models.actuator.law import TABLE_1, ForceLaw, checked_force, coefficients
from mount_models.actuator.law_check import ForceLawRefusedError, check_force_law
from mount_models.compiled import compiled

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ForceLawFit:
    """A fitted law and how well it meets its measurements.

    `relative_rms` and `worst` are relative to the measured force and count forces above 20 N; `rms_error` and
    `largest_error` (N) count all. `gaps` (m, shape (G,)) and `gap_rms` (N) tell where it fits less well.
    """

    law: ForceLaw
    relative_rms: float
    worst: float
    rms_error: float
    largest_error: float
    gaps: FloatArray
    gap_rms: FloatArray


def fit_force_law(
    gap: npt.ArrayLike,
    current: npt.ArrayLike,
    force: npt.ArrayLike,
    orders: tuple[int, int, int, int, int] = (4, 4, 4, 2, 4),
) -> ForceLawFit:
    """Return the law that fits `force` (N) measured at `gap` (m) and `current` (A), shapes that broadcast.

    `orders` are the numbers of coefficients of a1 .. a5; as in Table 1 there are 18. The search starts from
    Table 1 with weights 1 / (2 N + 0.02 F). The law is guarded to the measured gaps and currents, and refused
    (`ForceLawRefusedError`) where within them it is not positive, rising with current and falling with gap.
    """
    gaps, currents, forces = _checked_points(gap, current, force, sum(orders))
    box = (float(gaps.min()), float(gaps.max()), float(currents.max()))
    centre, half = 0.5 * (box[1] + box[0]), 0.5 * (box[1] - box[0])
    domain = ((centre - half) * 1e6, (centre + half) * 1e6)
    weight = 1.0 / (2.0 + 0.02 * np.abs(forces))

    powers = _powers(gaps, orders, centre, half)
    belongs_to = np.repeat(np.arange(5), orders)

    def misfit(unknowns: FloatArray) -> FloatArray:
        law = _law_from(unknowns, orders, domain, box)
        return np.asarray((checked_force(law, currents, gaps) - forces) * weight)

    def slopes(unknowns: FloatArray) -> FloatArray:
        law = _law_from(unknowns, orders, domain, box)
        return np.asarray(
            _coefficient_slopes(law, currents, gaps)[:, belongs_to] * powers * weight[:, np.newaxis]
        )

    found = least_squares(
        misfit,
        _start(orders, domain),
        slopes,
        x_scale='jac',
        ftol=1e-15,
        xtol=1e-15,
        gtol=1e-15,
        max_nfev=2000,
    )
    law = _law_from(found.x, orders, domain, box)
    check_force_law(law)
    return _judged(law, gaps, currents, forces)


def _checked_points(
    gap: npt.ArrayLike, current: npt.ArrayLike, force: npt.ArrayLike, unknowns: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    arrays = np.broadcast_arrays(np.asarray(gap, float), np.asarray(current, float), np.asarray(force, float))
    gaps, currents, forces = (np.ravel(array) for array in arrays)
    if forces.size < 3 * unknowns:
        raise ForceLawRefusedError(
            f'force measurements ({forces.size}) must be at least {3 * unknowns}, three per coefficient; '
            f'measure more gaps or currents'
        )
    if not (np.isfinite(gaps).all() and np.isfinite(currents).all() and np.isfinite(forces).all()):
        raise ForceLawRefusedError('force measurements must be finite; leave out the points that failed')
    if np.unique(gaps).size < 4 or currents.min() < 0.0:
        raise ForceLawRefusedError(
            f'force measurements must span at least 4 air gaps ({np.unique(gaps).size} given) and currents '
            f'of 0 A or more (lowest {currents.min():.3f} A)'
        )
    return gaps, currents, forces


def _start(orders: tuple[int, ...], domain: tuple[float, float]) -> FloatArray:
    """Return Table 1 as the search sees it: coefficients in the gap mapped to -1 .. 1, cut to `orders`."""
    tables = (TABLE_1.a1, TABLE_1.a2, TABLE_1.a3, TABLE_1.a4, TABLE_1.a5)
    parts = []
    for table, order in zip(tables, orders, strict=True):
        mapped = Polynomial(table).convert(domain=domain, window=(-1.0, 1.0), kind=Polynomial).coef
        parts.append(np.pad(mapped, (0, max(0, order - mapped.size)))[:order])
    return np.concatenate(parts)


def _powers(gap: FloatArray, orders: tuple[int, ...], centre: float, half: float) -> FloatArray:
    """Return the powers of the mapped gap that stand beside each unknown, shape (points, unknowns)."""
    mapped = (gap - centre) / half
    return np.concatenate([mapped[:, np.newaxis] ** np.arange(order) for order in orders], axis=1)


@compiled
def _coefficient_slopes(law, current, gap):
    """Return the derivatives of Eq (3) with respect to a1 .. a5, shape (points, 5)."""
    slopes = np.empty((gap.size, 5))
    for k in range(gap.size):
        i = current[k]
        a1, a2, a3, a4, a5 = coefficients(law, gap[k])
        line, parabola = a1 + a2 * i, a5 * i * i
        knee, bend = math.atan(a3 * a4), math.atan(a3 * (i - a4))
        knee_fall, bend_fall = 1.0 / (1.0 + (a3 * a4) ** 2), 1.0 / (1.0 + (a3 * (i - a4)) ** 2)
        slopes[k, 0] = knee + bend
        slopes[k, 1] = i * (knee + bend)
        slopes[k, 2] = (line + parabola) * a4 * knee_fall + (line - parabola) * (i - a4) * bend_fall
        slopes[k, 3] = ((line + parabola) * knee_fall - (line - parabola) * bend_fall) * a3
        slopes[k, 4] = i * i * (knee - bend)
    return slopes


def _law_from(
    unknowns: FloatArray,
    orders: tuple[int, ...],
    domain: tuple[float, float],
    box: tuple[float, float, float],
) -> ForceLaw:
    edges = np.concatenate([[0], np.cumsum(orders)])
    a1, a2, a3, a4, a5 = (
        _plain(unknowns[first:last], domain, int(last - first)) for first, last in pairwise(edges)
    )
    return ForceLaw(a1, a2, a3, a4, a5, *box)


def _plain(mapped: FloatArray, domain: tuple[float, float], order: int) -> tuple[float, ...]:
    """Return coefficients in powers of the gap in micrometres from those in the mapped gap."""
    plain = Polynomial(mapped, domain=domain, window=(-1.0, 1.0)).convert(kind=Polynomial).coef
    return tuple(float(value) for value in np.pad(plain, (0, order - plain.size)))


def _judged(law: ForceLaw, gap: FloatArray, current: FloatArray, force: FloatArray) -> ForceLawFit:
    error = checked_force(law, current, gap) - force
    strong = force > 20.0
    relative = error[strong] / force[strong]
    gaps = np.unique(gap)
    return ForceLawFit(
        law=law,
        relative_rms=float(np.sqrt(np.mean(relative**2))) if strong.any() else np.nan,
        worst=float(np.abs(relative).max()) if strong.any() else np.nan,
        rms_error=float(np.sqrt(np.mean(error**2))),
        largest_error=float(np.abs(error).max()),
        gaps=gaps,
        gap_rms=np.array([np.sqrt(np.mean(error[gap == value] ** 2)) for value in gaps]),
    )
