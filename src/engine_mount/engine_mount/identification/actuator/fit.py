"""Fit the force law (Eqs 3, 4) to measured forces, as the authors did for Table 1."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.actuator.fit_start import starts
from engine_mount.identification.actuator.points import (
    Orders,
    check_outliers,
    checked_points,
    far_points,
    gap_groups,
)
from engine_mount.identification.single_threaded import single_threaded
from mount_models.actuator.law import LOWEST_SHARE, ForceLaw, check_force_law, checked_force, coefficients
from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import LawRefusedError

FloatArray = npt.NDArray[np.float64]

TABLE_1_ORDERS: Orders = (4, 4, 4, 2, 4)
"""Numbers of coefficients of a1 .. a5 in Table 1; together 18."""


@dataclass(frozen=True)
class ForceLawFit:
    """A fitted law and how well it meets its measurements.

    `relative_rms` and `worst` are relative to the measured force and count forces above 20 N; `rms_error` and
    `largest_error` (N) count all. `gaps` (m, shape (G,)) and `gap_rms` (N) tell where it fits less well.
    `covariance` (P, P) is that of the coefficients a1 .. a5 as the law holds them, one after the other,
    scaled by the scatter of the residuals; what the law cannot describe counts as scatter. `lowest_current`
    (A) is the lowest that was measured.
    """

    law: ForceLaw
    relative_rms: float
    worst: float
    rms_error: float
    largest_error: float
    gaps: FloatArray
    gap_rms: FloatArray
    covariance: FloatArray
    points: int
    lowest_current: float

    @property
    def continued(self) -> bool:
        """Whether the law holds for currents below the lowest measured one, continued to 0 N at 0 A."""
        return self.lowest_current > _FROM_ZERO * self.law.current_high

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON, SI units; None where one is not known."""
        law = self.law
        parts = {part: list(getattr(law, part)) for part in ('a1', 'a2', 'a3', 'a4', 'a5')}
        stds = iter(self.covariance.diagonal().clip(0.0) ** 0.5)
        return {
            'parameters': parts,
            'parameter_std': {part: [float(next(stds)) for _ in values] for part, values in parts.items()},
            'valid_gap_m': [law.gap_low, law.gap_high],
            'valid_current_a': [0.0, law.current_high],
            'measured_current_a': [self.lowest_current, law.current_high],
            'points': self.points,
            'relative_rms': _known(self.relative_rms),
            'relative_worst': _known(self.worst),
            'rms_error_n': self.rms_error,
            'largest_error_n': self.largest_error,
            'rms_by_gap': [{'gap_m': g, 'rms_n': r} for g, r in zip(self.gaps, self.gap_rms, strict=True)],
        }


@single_threaded
def fit_force_law(
    gap: npt.ArrayLike,
    current: npt.ArrayLike,
    force: npt.ArrayLike,
    orders: Orders = TABLE_1_ORDERS,
    force_floor: float = 2.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> ForceLawFit:
    """Return the law that fits `force` (N) measured at `gap` (m) and `current` (A), shapes that broadcast.

    `orders` are the numbers of coefficients of a1 .. a5; as in Table 1 there are 18. Weights are
    1 / (`force_floor` + 0.02 F). The search starts from several places derived from the points (`fit_start`)
    and keeps the best, within bounds. The law is guarded to the measured gaps and currents, and refused
    (`LawRefusedError`) where within them it is not positive, rising with current and falling with gap;
    so are points that lie far from it, and points too few.
    """
    gaps, currents, forces = checked_points(gap, current, force, orders)
    box = (float(gaps.min()), float(gaps.max()), float(currents.max()))
    centre, half = 0.5 * (box[1] + box[0]), 0.5 * (box[1] - box[0])
    domain = ((centre - half) * 1e6, (centre + half) * 1e6)
    tolerance = force_floor + 0.02 * np.abs(forces)

    powers = _powers(gaps, orders, centre, half)
    belongs_to = np.repeat(np.arange(5), orders)

    def misfit(unknowns: FloatArray) -> FloatArray:
        law = _law_from(unknowns, orders, domain, box)
        return np.asarray((checked_force(law, currents, gaps) - forces) / tolerance)

    def slopes(unknowns: FloatArray) -> FloatArray:
        law = _law_from(unknowns, orders, domain, box)
        of_coefficients = _coefficient_slopes(law, currents, gaps)[:, belongs_to]
        return np.asarray(of_coefficients * powers / tolerance[:, np.newaxis])

    mapped = (gaps - centre) / half
    candidates = starts(mapped, currents, forces, tolerance, orders, domain)
    found = _best(misfit, slopes, candidates, _bounds(orders, currents, forces), forces, progress)
    law = _law_from(found.x, orders, domain, box)
    check_outliers(gaps, currents, forces, checked_force(law, currents, gaps), tolerance)
    _check(law, float(currents.min()))
    return _judged(law, gaps, currents, forces, _covariance(found, orders, domain))


_FROM_ZERO = 0.05  # of the largest current, chosen: measured from below, the law counts as measured from 0 A
_SHORT_SEARCH = 60  # steps, chosen: tells good starts from bad ones
_LONG_SEARCH = 2000
_PRECISION = 1e-15
_WIDE = 50.0  # chosen: bounds only keep the search out of nonsense


def _best(
    misfit: Callable[[FloatArray], FloatArray],
    slopes: Callable[[FloatArray], FloatArray],
    candidates: list[FloatArray],
    bounds: tuple[FloatArray, FloatArray],
    forces: FloatArray,
    progress: Callable[[int, int], None],
) -> OptimizeResult:
    """Return the end of the best of several searches; outliers pull the first ones little."""

    def search(start: FloatArray, steps: int, scale: float, loss: str) -> OptimizeResult:
        return least_squares(
            misfit,
            np.clip(start, *bounds),
            slopes,
            bounds=bounds,
            x_scale='jac',
            loss=loss,
            f_scale=scale,
            ftol=_PRECISION,
            xtol=_PRECISION,
            gtol=_PRECISION,
            max_nfev=steps,
        )

    total = len(candidates) + 1
    ends = []
    for number, start in enumerate(candidates):
        progress(number, total)
        ends.append(search(start, _SHORT_SEARCH, 1.0, 'soft_l1'))
    progress(len(candidates), total)
    best = min(ends, key=lambda end: float(end.cost))
    if far_points(forces, np.abs(misfit(best.x))).size:
        progress(total, total)
        return best  # with outliers a least-squares search would hide them
    final = search(best.x, _LONG_SEARCH, 1.0, 'linear')
    progress(total, total)
    return final


def _bounds(orders: Orders, currents: FloatArray, forces: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return bounds of the coefficients in the mapped gap, by the size of forces and currents."""
    force, current = float(forces.max()), float(currents.max())
    scales = (force, force / current, 1.0 / current, current, force / current**2)
    low, high = [], []
    for order, scale in zip(orders, scales, strict=True):
        reach = _WIDE * scale
        low.append(np.full(order, -reach))
        high.append(np.full(order, reach))
    # the knee is a knee: a mean sharpness and a mean current of it above 0
    low[2][0], low[3][0] = 0.1 / current, 0.01 * current
    return np.concatenate(low), np.concatenate(high)


def _covariance(found: OptimizeResult, orders: Orders, domain: tuple[float, float]) -> FloatArray:
    """Return the covariance of the plain coefficients from the slopes at the end of the search."""
    jacobian = np.asarray(found.jac)
    freedom = max(1, jacobian.shape[0] - jacobian.shape[1])
    scatter = float(np.sum(np.asarray(found.fun) ** 2)) / freedom
    columns = np.linalg.norm(jacobian, axis=0)
    columns[columns == 0.0] = 1.0
    scaled = np.linalg.pinv((jacobian / columns).T @ (jacobian / columns), hermitian=True)
    mapped = scatter * scaled / np.outer(columns, columns)
    blocks = np.zeros_like(mapped)
    edges = np.concatenate([[0], np.cumsum(orders)])
    for first, last in pairwise(edges):
        for column in range(last - first):
            unit = np.eye(last - first)[column]
            blocks[first:last, first + column] = _plain(unit, domain, int(last - first))
    return np.asarray(blocks @ mapped @ blocks.T)


def _powers(gap: FloatArray, orders: Orders, centre: float, half: float) -> FloatArray:
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
    orders: Orders,
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
    return tuple((_unmapping(domain, order) @ mapped).tolist())


@functools.lru_cache(maxsize=32)
def _unmapping(domain: tuple[float, float], order: int) -> FloatArray:
    """Return the matrix from coefficients in the mapped gap to those in the gap, shape (order, order).

    It is the same at each step of a search, and to derive it takes longer than all else in the step.
    """
    columns = []
    for unit in np.eye(order):
        plain = Polynomial(unit, domain=domain, window=(-1.0, 1.0)).convert(kind=Polynomial).coef
        columns.append(np.pad(plain, (0, order - plain.size)))
    return np.stack(columns, axis=1)


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _check(law: ForceLaw, lowest: float) -> None:
    """Raise `LawRefusedError` for a law that cannot be inverted; it says where nothing was measured."""
    try:
        check_force_law(law)
    except LawRefusedError as error:
        if lowest <= LOWEST_SHARE * law.current_high:
            raise
        check_force_law(law, lowest)
        raise LawRefusedError(
            f'forces were measured from {lowest:.2f} A on only, where the law is right; below it is '
            'continued to '
            f'0 N at 0 A, and that fails: {str(error).partition(":")[0]}: measure from '
            f'{LOWEST_SHARE * law.current_high:.2f} A on'
        ) from error


def _judged(
    law: ForceLaw, gap: FloatArray, current: FloatArray, force: FloatArray, covariance: FloatArray
) -> ForceLawFit:
    error = checked_force(law, current, gap) - force
    strong = force > 20.0
    relative = error[strong] / force[strong]
    groups = gap_groups(gap)
    return ForceLawFit(
        law=law,
        relative_rms=float(np.sqrt(np.mean(relative**2))) if strong.any() else np.nan,
        worst=float(np.abs(relative).max()) if strong.any() else np.nan,
        rms_error=float(np.sqrt(np.mean(error**2))),
        largest_error=float(np.abs(error).max()),
        gaps=np.array([gap[group].mean() for group in groups]),
        gap_rms=np.array([np.sqrt(np.mean(error[group] ** 2)) for group in groups]),
        covariance=covariance,
        points=int(force.size),
        lowest_current=float(current.min()),
    )
