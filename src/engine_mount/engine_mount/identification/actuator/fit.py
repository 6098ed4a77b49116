"""Fit the force law (Eqs 3, 4) to measured forces, as the authors did for Table 1."""

import functools
import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial
from scipy.linalg import block_diag
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.actuator.points import (
    ForcePoints,
    Orders,
    check_outliers,
    checked_points,
    far_points,
    gap_groups,
)
from engine_mount.identification.actuator.start import Problem, starts
from engine_mount.identification.fitting import (
    FloatArray,
    Progress,
    covariance_of,
    silent,
    single_threaded,
)
from mount_models.actuator import LOWEST_SHARE, ForceLaw, check_force_law, checked_force, coefficients
from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import LawRefusedError

TABLE_1_ORDERS: Orders = (4, 4, 4, 2, 4)
"""Numbers of coefficients of a1 .. a5 in Table 1; together 18."""
_STRONG = 20.0  # N: relative errors count above it
_FROM_ZERO = 0.05  # of the largest current, chosen: measured from below, the law counts as measured from 0 A
_SHORT_SEARCH = 60  # steps, chosen: sorts good starts from bad ones
_LONG_SEARCH = 2000
_PRECISION = 1e-15
_WIDE = 50.0  # chosen: bounds only keep the search out of nonsense


@dataclass(frozen=True)
class ForceLawFit:
    """A fitted law, the points it was fitted to, and the covariance (P, P) of its coefficients.

    The coefficients are a1 .. a5 as the law holds them, one after the other; the covariance is scaled by the
    scatter of the residuals, to which all counts that the law cannot describe.
    """

    law: ForceLaw
    points: ForcePoints
    covariance: FloatArray

    @cached_property
    def error(self) -> FloatArray:
        """Law minus point, N."""
        return checked_force(self.law, self.points.current, self.points.gap) - self.points.force

    @cached_property
    def groups(self) -> list[npt.NDArray[np.intp]]:
        """Places of the points of each gap."""
        return gap_groups(self.points.gap)

    @property
    def gaps(self) -> FloatArray:
        """Measured gaps, m."""
        return np.array([self.points.gap[group].mean() for group in self.groups])

    @property
    def gap_rms(self) -> FloatArray:
        """Rms error at each gap, N: where it fits less well."""
        return np.array([np.sqrt(np.mean(self.error[group] ** 2)) for group in self.groups])

    @property
    def relative(self) -> FloatArray:
        """Errors over forces, where these are above 20 N; NaN where none is."""
        strong = self.points.force > _STRONG
        return self.error[strong] / self.points.force[strong] if strong.any() else np.array([np.nan])

    @property
    def lowest_current(self) -> float:
        """The lowest current that was measured, A."""
        return float(self.points.current.min())

    @property
    def continued(self) -> bool:
        """Whether the law holds for currents below the lowest measured one, continued to 0 N at 0 A."""
        return self.lowest_current > _FROM_ZERO * self.law.current_high


@single_threaded()
def fit_force_law(
    gap: npt.ArrayLike,
    current: npt.ArrayLike,
    force: npt.ArrayLike,
    orders: Orders = TABLE_1_ORDERS,
    force_floor: float = 2.0,
    progress: Progress = silent,
) -> ForceLawFit:
    """Return the law that fits `force` (N) measured at `gap` (m) and `current` (A), shapes that broadcast.

    `orders` are the numbers of coefficients of a1 .. a5; as in Table 1 there are 18. Weights are
    1 / (`force_floor` + 0.02 F). The search starts from several places derived from the points (`starts`)
    and keeps the best, within bounds. The law is guarded to the measured gaps and currents, and refused
    (`LawRefusedError`) where within them it is not positive, rising with current and falling with gap;
    so are points that lie far from it, and points too few.
    """
    points = checked_points(gap, current, force, orders)
    gaps, currents, forces = points
    box = (float(gaps.min()), float(gaps.max()), float(currents.max()))
    centre, half = 0.5 * (box[1] + box[0]), 0.5 * (box[1] - box[0])
    domain = ((centre - half) * 1e6, (centre + half) * 1e6)
    tolerance = force_floor + 0.02 * np.abs(forces)
    mapped = (gaps - centre) / half
    edges = np.cumsum([0, *orders])
    powers = np.concatenate([mapped[:, np.newaxis] ** np.arange(order) for order in orders], axis=1)
    belongs_to = np.repeat(np.arange(5), orders)

    def law_of(unknowns: FloatArray) -> ForceLaw:
        parts = (
            (_unmapping(domain, int(last - first)) @ unknowns[first:last]).tolist()
            for first, last in pairwise(edges)
        )
        a1, a2, a3, a4, a5 = map(tuple, parts)
        return ForceLaw(a1, a2, a3, a4, a5, *box)

    def misfit(unknowns: FloatArray) -> FloatArray:
        return np.asarray((checked_force(law_of(unknowns), currents, gaps) - forces) / tolerance)

    def slopes(unknowns: FloatArray) -> FloatArray:
        of_coefficients = _coefficient_slopes(law_of(unknowns), currents, gaps)[:, belongs_to]
        return np.asarray(of_coefficients * powers / tolerance[:, np.newaxis])

    strongest, highest = float(forces.max()), box[2]
    scales = strongest, strongest / highest, 1.0 / highest, highest, strongest / highest**2
    high = np.repeat([_WIDE * scale for scale in scales], orders)
    low = -high
    # the knee is a knee: a mean sharpness and a mean current of it above 0
    low[edges[2]], low[edges[3]] = 0.1 / highest, 0.01 * highest

    def search(start: FloatArray, steps: int, loss: str) -> OptimizeResult:
        return least_squares(
            misfit, np.clip(start, low, high), slopes, bounds=(low, high), x_scale='jac', loss=loss,
            ftol=_PRECISION, xtol=_PRECISION, gtol=_PRECISION, max_nfev=steps,
        )  # fmt: skip

    candidates = starts(Problem(mapped, currents, forces, tolerance, orders, domain))
    ends = []
    for number, start in enumerate(candidates):
        progress(number / (len(candidates) + 1), 'fitting')
        ends.append(search(start, _SHORT_SEARCH, 'soft_l1'))  # outliers pull the first searches little
    best = min(ends, key=lambda end: float(end.cost))
    if not far_points(forces, np.abs(misfit(best.x))).size:
        progress(len(candidates) / (len(candidates) + 1), 'fitting')
        best = search(best.x, _LONG_SEARCH, 'linear')  # with outliers it would hide them
    law = law_of(best.x)
    check_outliers(points, checked_force(law, currents, gaps), tolerance)
    _check_law(law, float(currents.min()))
    unmapping = block_diag(*(_unmapping(domain, order) for order in orders))
    return ForceLawFit(law, points, unmapping @ covariance_of(best) @ unmapping.T)


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


@functools.lru_cache(maxsize=32)
def _unmapping(domain: tuple[float, float], order: int) -> FloatArray:
    """Return the matrix from coefficients in the mapped gap to those in the gap (um), shape (order, order).

    It is the same at each step of a search, and to derive it takes longer than all else in the step.
    """
    columns = []
    for unit in np.eye(order):
        plain = Polynomial(unit, domain=domain, window=(-1.0, 1.0)).convert(kind=Polynomial).coef
        columns.append(np.pad(plain, (0, order - plain.size)))
    return np.stack(columns, axis=1)


def _check_law(law: ForceLaw, lowest: float) -> None:
    """Raise `LawRefusedError` for a law that cannot be inverted, and say where nothing was measured."""
    try:
        check_force_law(law)
    except LawRefusedError as error:
        if lowest <= LOWEST_SHARE * law.current_high:
            raise
        check_force_law(law, lowest)
        raise LawRefusedError(
            f'forces were measured from {lowest:.2f} A on only, where the law is right; below it is '
            f'continued to 0 N at 0 A, and that fails: {str(error).partition(":")[0]}: measure from '
            f'{LOWEST_SHARE * law.current_high:.2f} A on'
        ) from error
