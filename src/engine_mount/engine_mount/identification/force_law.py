"""Fit the force law (Eqs 3, 4) to measured forces, as the authors did for Table 1; the specimen of it.

With a3 and a4 chosen, Eq (3) is linear in a1, a2 and a5. So the searches begin at places derived from the
points, whatever the actuator's size.
"""

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyfit, polyval, polyvander
from scipy.linalg import block_diag
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.fitting import (
    FloatArray,
    Progress,
    covariance_of,
    rms,
    silent,
    single_threaded,
)
from engine_mount.identification.force_points import (
    ORDERS,
    ForcePoints,
    check_outliers,
    check_zero,
    checked_points,
    far_points,
    gap_groups,
)
from engine_mount.identification.specimen import described_files, rounded, with_part
from engine_mount.recordings.difference import known
from engine_mount.recordings.screen import Screen, Table
from mount_models.actuator import (
    TABLE_1,
    ForceLaw,
    check_force_law,
    checked_force,
    coefficients,
)
from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import LawRefusedError
from mount_models.specimen import Specimen

_STRONG = 20.0  # N: relative errors count above it
_FROM_ZERO = 0.05  # of the largest current, chosen: measured from below, the law counts as measured from 0 A
_SHORT_SEARCH = 60  # steps, chosen: sorts good starts from bad ones
_LONG_SEARCH = 2000
_SIMPLER = 1.6  # chosen: misfit of a law without saturation that is preferred, over that of Eq (3)
_PRECISION = 1e-15
_WIDE = 50.0  # chosen: bounds only keep the search out of nonsense
_KNEES = (0.3, 0.45, 0.6, 0.8)  # chosen: current of the knee over the largest one, at the mean gap
_LEAN = 0.2  # chosen: the knee moves to higher currents with the gap
_SHARPNESSES = (2.0, 4.0, 9.0, 18.0)  # chosen: a3 times the largest current
_TRIED = 3
_SURE = 0.1  # of the median force, chosen: there noise moves a root little
_DEGREE = 12  # chosen: 1 / R^2 to 0.1 % where the largest R is six times the smallest
_EDGES = np.cumsum([0, *ORDERS])

Problem = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""Points as the search sees them: gap mapped to -1 .. 1, A, N, tolerance N."""


@dataclass(frozen=True)
class ForceLawFit:
    """A fitted law, the points it was fitted to, and the covariance of its coefficients.

    The coefficients are a1 .. a5 as the law holds them, one after the other; the covariance is scaled by the
    scatter of the residuals, to which all counts that the law cannot describe.
    """

    law: ForceLaw
    points: ForcePoints
    covariance: FloatArray

    @functools.cached_property
    def error(self) -> FloatArray:
        """Law minus point, N."""
        return checked_force(self.law, self.points.current, self.points.gap) - self.points.force

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Each measured gap (m) with its rms error (N): where it fits less well."""
        return [
            (float(self.points.gap[group].mean()), rms(self.error[group]))
            for group in gap_groups(self.points.gap)
        ]

    @property
    def relative(self) -> FloatArray:
        """Errors over forces, where these are above 20 N; NaN where none is."""
        strong = self.points.force > _STRONG
        return self.error[strong] / self.points.force[strong] if strong.any() else np.array([np.nan])

    @property
    def measured_from(self) -> float:
        """The lowest current that was measured (A); below, the law is continued to 0 N at 0 A. 0 if near."""
        lowest = self.points.current.min()
        return lowest if lowest > _FROM_ZERO * self.law.current_high else 0.0

    def residuals(self) -> dict[str, float]:
        """Return the errors over all points: N, and of forces above 20 N relative to them."""
        return {
            'relative_rms': rms(self.relative),
            'relative_worst': np.abs(self.relative).max(),
            'rms': rms(self.error),
            'largest': np.abs(self.error).max(),
        }


@dataclass(frozen=True)
class ActuatorCalibration:
    """A fitted force law, the files it comes from, and the specimen that gives all other values."""

    fit: ForceLawFit
    base: Specimen
    files: Sequence[Path]

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON, SI units; None where one is not known."""
        law, residuals = self.fit.law, self.fit.residuals()
        stds = np.split(
            np.sqrt(self.fit.covariance.diagonal().clip(0.0)), np.cumsum([len(part) for part in law[:4]])
        )
        return {
            'parameters': {f'a{number}': list(part) for number, part in enumerate(law[:5], 1)},
            'parameter_std': {f'a{number}': part.tolist() for number, part in enumerate(stds, 1)},
            'valid_gap_m': [law.gap_low, law.gap_high],
            'valid_current_a': [0.0, law.current_high],
            'measured_current_a': [float(self.fit.points.current.min()), law.current_high],
            'points': self.fit.error.size,
            'relative_rms': known(residuals['relative_rms']),
            'relative_worst': known(residuals['relative_worst']),
            'rms_error_n': residuals['rms'],
            'largest_error_n': residuals['largest'],
            'rms_by_gap': [{'gap_m': gap, 'rms_n': off} for gap, off in self.fit.gaps],
        }

    def report(self, screen: Screen) -> None:
        """Show the errors of each gap, and where the law may be used."""
        law, start, residuals = self.fit.law, self.fit.measured_from, self.fit.residuals()
        rows = [(f'{1e6 * gap:.1f}', f'{off:.2f}') for gap, off in self.fit.gaps]
        title = 'force law, ' + ('18 parameters' if len(law.a1) > 1 else 'without saturation')
        screen.table(Table(title, 'rr', rows, ('air gap (um)', 'rms error (N)')))
        screen.say(
            f'{self.fit.error.size} points; error rms {residuals["relative_rms"]:.2%} of the force above '
            f'{_STRONG:g} N, worst {residuals["relative_worst"]:.2%}; rms {residuals["rms"]:.2f} N, largest '
            f'{residuals["largest"]:.2f} N'
        )
        screen.say(
            f'positive, rising with the current and falling with the gap within {law.gap_low * 1e6:.1f} .. '
            f'{law.gap_high * 1e6:.1f} um and 0 .. {law.current_high:.2f} A; refused beyond'
        )
        if start:
            screen.say(f'measured from {start:.2f} A on; below, the law is continued to 0 N at 0 A')

    def specimen(self, name: str = '') -> Specimen:
        """Return the base under `name` with the fitted law; raises `SpecimenError`."""
        fit, law = self.fit, self.fit.law
        gaps, errors = zip(*fit.gaps, strict=True)
        valid = {'gap': [law.gap_low, law.gap_high], 'current': [0.0, law.current_high]}
        if fit.measured_from:
            valid['measured_current'] = [rounded(fit.measured_from), law.current_high]
        origin = {
            'points': fit.error.size,
            'valid': valid,
            'residuals': {
                **{each: rounded(value) for each, value in fit.residuals().items()},
                'gaps': [float(f'{gap:.6g}') for gap in gaps],
                'rms_by_gap': rounded(errors),
            },
            'covariance': rounded(fit.covariance),
        }
        limit = min(self.base.current_limit, law.current_high)
        recordings = described_files(self.files)
        return with_part(self.base, name, 'force_law', recordings, origin, force_law=law, current_limit=limit)

    def draw(self, file: Path) -> None:
        """Write the picture of points and law to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_force_law

        draw_force_law(self.fit, file)


@single_threaded
def fit_force_law(
    gap: npt.ArrayLike,
    current: npt.ArrayLike,
    force: npt.ArrayLike,
    force_floor: float = 2.0,
    progress: Progress = silent,
) -> ForceLawFit:
    """Return the law that fits `force` (N) measured at `gap` (m) and `current` (A), shapes that broadcast.

    As in Table 1 there are 18 coefficients. Weights are 1 / (`force_floor` + 0.02 F). The search starts from
    several places derived from the points and keeps the best, within bounds. The law is guarded to the
    measured gaps and currents; within them it is positive, rises with current and falls with gap, and is held
    to that where noise alone speaks against it. Raises `LawRefusedError` where the forces do, for a zero of
    the load cell, points that lie far from the law, and points too few.
    """
    points = checked_points(gap, current, force)
    check_zero(points)
    gaps, currents, forces = points
    box = (float(gaps.min()), float(gaps.max()), float(currents.max()))
    centre, half = 0.5 * (box[1] + box[0]), 0.5 * (box[1] - box[0])
    domain = ((centre - half) * 1e6, (centre + half) * 1e6)
    tolerance = force_floor + 0.02 * np.abs(forces)
    mapped = (gaps - centre) / half
    powers = np.concatenate([mapped[:, np.newaxis] ** np.arange(order) for order in ORDERS], axis=1)
    belongs_to = np.repeat(np.arange(5), ORDERS)

    def law_of(unknowns: FloatArray) -> ForceLaw:
        parts = np.split(unknowns, _EDGES[1:-1])
        a1, a2, a3, a4, a5 = (tuple((_unmapping(domain, part.size) @ part).tolist()) for part in parts)
        return ForceLaw(a1, a2, a3, a4, a5, *box)

    def misfit(unknowns: FloatArray) -> FloatArray:
        return (checked_force(law_of(unknowns), currents, gaps) - forces) / tolerance

    def slopes(unknowns: FloatArray) -> FloatArray:
        of_coefficients = _coefficient_slopes(law_of(unknowns), currents, gaps)[:, belongs_to]
        return of_coefficients * powers / tolerance[:, np.newaxis]

    strongest, highest = forces.max(), box[2]
    scales = strongest, strongest / highest, 1.0 / highest, highest, strongest / highest**2
    high = np.repeat([_WIDE * scale for scale in scales], ORDERS)
    low = -high
    # the knee is a knee: a mean sharpness and a mean current of it above 0
    low[_EDGES[2]], low[_EDGES[3]] = 0.1 / highest, 0.01 * highest

    def search(start: FloatArray, steps: int, loss: str) -> OptimizeResult:
        return least_squares(
            misfit, np.clip(start, low, high), slopes, bounds=(low, high), x_scale='jac', loss=loss,
            ftol=_PRECISION, xtol=_PRECISION, gtol=_PRECISION, max_nfev=steps,
        )  # fmt: skip

    def fit_of(unknowns: FloatArray) -> ForceLawFit:
        covariance = covariance_of(OptimizeResult(jac=slopes(unknowns), fun=misfit(unknowns)))
        unmapping = block_diag(*(_unmapping(domain, order) for order in ORDERS))
        return ForceLawFit(law_of(unknowns), points, unmapping @ covariance @ unmapping.T)

    candidates = _starts((mapped, currents, forces, tolerance), domain)
    ends = []
    for number, start in enumerate(candidates):
        progress(number / len(candidates), 'fitting')
        ends.append(search(start, _SHORT_SEARCH, 'soft_l1'))  # outliers pull the first searches little
    best = min(ends, key=lambda end: end.cost)
    if not far_points(forces, np.abs(misfit(best.x))).size:
        best = search(best.x, _LONG_SEARCH, 'linear')  # with outliers it would hide them
    parabola, covariance = _unsaturated_parabola(mapped, currents, forces, tolerance)
    unmapping = _unmapping(domain, parabola.size) / np.pi
    # a3 and a4 are chosen: beyond so far and sharp a knee a5 is true to six digits
    law = ForceLaw(
        (0.0,), (0.0,), (1e6 / highest,), (2.0 * highest,), tuple((unmapping @ parabola).tolist()), *box
    )
    simple = ForceLawFit(law, points, block_diag(np.zeros((4, 4)), unmapping @ covariance @ unmapping.T))
    off = rms(misfit(best.x))
    fit = simple if rms(simple.error / tolerance) <= _SIMPLER * off else fit_of(best.x)
    check_outliers(points, forces + fit.error, tolerance)
    try:
        check_force_law(fit.law)
    except LawRefusedError:
        # is it the forces that contradict, or noise in a search that knows of no such demand?
        # The places are those of `check_force_law`: between coarser ones a law may turn
        gap, current = np.linspace(*box[:2], 61)[:, np.newaxis], np.linspace(0.0, highest, 121)
        pull, found = checked_force(simple.law, current, gap), best.x

        def held(unknowns: FloatArray, hold: float) -> FloatArray:
            lack = _shortfall(checked_force(law_of(unknowns), current, gap), pull)
            return np.append(misfit(unknowns), hold * lack)

        for hold in (1e2, 1e4, 1e6):  # chosen
            found = least_squares(
                held, found, args=(hold,), bounds=(low, high), x_scale='jac', ftol=1e-6, max_nfev=200
            ).x
        fit = fit_of(found)
        if rms(fit.error / tolerance) > 2.0 * off:  # chosen: more than noise explains
            raise
        check_force_law(fit.law)
    return fit


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


def _starts(problem: Problem, domain: tuple[float, float]) -> list[FloatArray]:
    """Return coefficients of a1 .. a5 in the mapped gap to start from, the best first, at last Table 1."""
    trials = itertools.product(_SHARPNESSES, _KNEES)
    ends = sorted((_completed(problem, *trial) for trial in trials), key=lambda end: end[0])
    table_1 = [
        Polynomial(part).convert(domain=domain, window=(-1.0, 1.0), kind=Polynomial).coef
        for part in TABLE_1[:5]
    ]
    return [*(start for _, start in ends[:_TRIED]), np.concatenate(table_1)]


def _completed(problem: Problem, sharpness: float, knee: float) -> tuple[float, FloatArray]:
    """Return misfit and all coefficients for a3 and a4 that are given by shares of the largest current."""
    gap, current, force, tolerance = problem
    highest = current.max()
    a3, a4 = np.array([sharpness / highest, 0.0, 0.0, 0.0]), knee * highest * np.array([1.0, _LEAN])
    at = polyval(gap, a4)
    low, bend = np.arctan(a3[0] * at), np.arctan(a3[0] * (current - at))
    line, square = (low + bend) / tolerance, current**2 * (low - bend) / tolerance
    powers = polyvander(gap, 3).T
    columns = np.concatenate([line * powers, line * current * powers, square * powers]).T
    solution = np.linalg.lstsq(columns, force / tolerance, 1e-5)[0]  # chosen: alike columns determine nothing
    a1, a2, a5 = np.split(solution, 3)
    return rms(columns @ solution - force / tolerance), np.concatenate([a1, a2, a3, a4, a5])


def _unsaturated_parabola(
    gap: FloatArray, current: FloatArray, force: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return F / i^2 = 1 / R^2 over the gap (-1 .. 1): coefficients, lowest power first, and covariance.

    A magnet without saturation has F = (i / R)^2 with R a parabola over the gap.
    """
    strong = (force > _SURE * np.median(force)) & (current > 0.0)
    current, force = current[strong], force[strong]
    weights = force**1.5 / (current * tolerance[strong])  # misfits of the root count as those of the force
    fitted, covariance = np.polyfit(gap[strong], current / np.sqrt(force), 2, w=weights, cov=True)
    nodes = np.cos(np.linspace(0.0, np.pi, 8 * _DEGREE))
    reluctance = np.polyval(fitted, nodes)
    slopes = -2.0 * np.vander(nodes, 3) / reluctance[:, np.newaxis] ** 3
    columns = np.column_stack([reluctance**-2, slopes])
    parabola, *carried = polyfit(nodes, columns, _DEGREE, w=reluctance**2).T
    return parabola, np.transpose(carried) @ covariance @ carried


def _shortfall(force: FloatArray, unsaturated: FloatArray) -> FloatArray:
    """Return how far rises with the current and falls with the gap miss a margin, 0 or less each.

    The forces (N), (gaps, currents from 0 A on), are compared with those without saturation.
    """
    rises = np.diff(force) / unsaturated[:, 1:]
    falls = -np.diff(force, axis=0)[:, 1:] / unsaturated[:-1, 1:]
    return np.minimum(np.append(rises, falls) - 3e-5, 0.0)  # chosen, of the force without saturation
