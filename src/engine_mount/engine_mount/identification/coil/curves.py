"""Gap curves with their uncertainty through points at known gaps, and their inverses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyder, polyfit, polyval, polyvander

from engine_mount.identification.coil.points import GapPoint
from engine_mount.identification.fitting import FloatArray, single_threaded
from mount_models.coil.gap import GapCurves, ScaledPolynomial, check_gap_curves, evaluate, slope
from mount_models.quantity import LawRefusedError

_FEWEST_GAPS = 6  # chosen: a cubic and two to judge it
_CONTRADICTION = 3e-6  # m, chosen: below it a point is as good as its gap could be set
_FAR = 10.0  # standard deviations, chosen: few points are a poor measure of their scatter
_NEARLY = 1.1  # chosen
_INVERSE_ERROR = 0.05e-6  # m


@dataclass(frozen=True)
class CurveFit:
    """A curve over the gap, the covariance of its coefficients, and its errors at the points as gaps (m).

    `largest_gap_std` (m) is the largest standard deviation of a gap read from it, by the curve alone.
    """

    polynomial: ScaledPolynomial
    covariance: FloatArray
    gap_errors: FloatArray
    gap_rms: float
    largest_gap_std: float

    @property
    def degree(self) -> int:
        """Degree of the polynomial."""
        return len(self.polynomial.coefficients) - 1


@dataclass(frozen=True)
class GapCalibration:
    """The four curves of the controller, and the two fits over the gap that they come from."""

    curves: GapCurves
    inductance: CurveFit
    crossing: CurveFit
    points: tuple[GapPoint, ...]


@single_threaded()
def calibrate_gap_curves(points: Sequence[GapPoint], highest_degree: int = 5) -> GapCalibration:
    """Return the curves through points at one temperature, both ways.

    The degree is the lowest that predicts each point from the others nearly as well as the best one. Raises
    `LawRefusedError` for too few gaps, a point that contradicts the others, or curves not monotone.
    """
    points = sorted(points, key=lambda point: point.gap)
    gaps = np.array([point.gap for point in points])
    if gaps.size < _FEWEST_GAPS or np.any(np.diff(gaps) < 1e-6):
        raise LawRefusedError(
            f'gap curves need recordings at {_FEWEST_GAPS} or more air gaps that differ by 1 um or more; '
            f'{gaps.size} given: {", ".join(f"{gap * 1e6:.1f}" for gap in gaps)} um: record more gaps, and '
            'each temperature and gap once'
        )
    fits, curves = [], []
    for what, value, std in (
        ('inductance at the rest current', 'inductance', 'inductance_std'),
        ('crossing current', 'crossing_current', 'crossing_std'),
    ):
        values, stds = (np.array([getattr(point, name) for point in points]) for name in (value, std))
        fits.append(_fit_curve(what, points, values, stds, highest_degree))
        curves += [fits[-1].polynomial, _inverse_curve(what, fits[-1].polynomial)]
    gap_curves = GapCurves(*curves)
    check_gap_curves(gap_curves)
    return GapCalibration(gap_curves, fits[0], fits[1], tuple(points))


def _fit_curve(
    what: str, points: Sequence[GapPoint], values: FloatArray, stds: FloatArray, highest_degree: int
) -> CurveFit:
    """Return the curve through `values` (n,) with deviations `stds` (n,) at the gaps of `points`."""
    gaps = np.array([point.gap for point in points])
    low, high = float(gaps.min()), float(gaps.max())
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    z = (gaps - centre) / scale
    floor = 1e-6 * float(np.median(np.abs(values)))
    weights = 1.0 / np.hypot(np.hypot(stds, np.median(stds)), floor)
    _check_agreement(what, points, z, values, weights)
    trials = []
    for degree in range(2, min(highest_degree, gaps.size - 3) + 1):
        coefficients, left_out, unscaled = _weighted(z, values, weights, degree)
        trials.append((float(np.sqrt(np.mean((left_out * weights) ** 2))), coefficients, unscaled))
    best = min(trial[0] for trial in trials)
    _, coefficients, unscaled = next(trial for trial in trials if trial[0] <= _NEARLY * best)
    polynomial = ScaledPolynomial(centre, scale, tuple(coefficients.tolist()), low, high)
    off = evaluate(polynomial, gaps) - values
    errors = off / np.maximum(np.abs(slope(polynomial, gaps)), 1e-12)
    scatter = float(np.sum((off * weights) ** 2)) / (gaps.size - coefficients.size)
    covariance = max(scatter, 1e-3) * unscaled
    dense = polyvander(np.linspace(-1.0, 1.0, 101), coefficients.size - 1)
    band = np.sqrt(np.einsum('ij,jk,ik->i', dense, covariance, dense))
    steep = np.maximum(np.abs(slope(polynomial, np.linspace(low, high, 101))), 1e-12)
    return CurveFit(
        polynomial, covariance, errors, float(np.sqrt(np.mean(errors**2))), float(np.max(band / steep))
    )


def _inverse_curve(what: str, polynomial: ScaledPolynomial) -> ScaledPolynomial:
    """Return the gap over the value of the curve, exact to `_INVERSE_ERROR` where a polynomial can be."""
    gaps = np.linspace(polynomial.low, polynomial.high, 201)
    values = evaluate(polynomial, gaps)
    steps = np.sign(np.diff(values))
    if not np.all(steps == steps[0]) or steps[0] == 0.0:
        turn = int(np.argmax(steps != steps[steps.size // 2]))
        raise LawRefusedError(
            f'the {what} must rise or fall steadily with the gap to separate gaps; it turns at '
            f'{gaps[turn] * 1e6:.0f} um: narrow the range of gaps, or choose another rest current or '
            'crossing inductance'
        )
    low, high = float(values.min()), float(values.max())
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    z = (values - centre) / scale
    for degree in range(3, 10):
        coefficients = polyfit(z, gaps, degree)
        if np.abs(polyval(z, coefficients) - gaps).max() <= _INVERSE_ERROR:
            break
    return ScaledPolynomial(centre, scale, tuple(coefficients.tolist()), low, high)


def _weighted(
    z: FloatArray, values: FloatArray, weights: FloatArray, degree: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return coefficients, the error of each point as the others predict it, and the plain covariance."""
    powers = polyvander(z, degree)
    orthogonal, triangle = np.linalg.qr(powers * weights[:, np.newaxis])
    coefficients = np.linalg.solve(triangle, orthogonal.T @ (values * weights))
    own_weight = np.minimum(np.sum(orthogonal**2, axis=1), 0.99)
    inverse = np.linalg.inv(triangle)
    return coefficients, (values - powers @ coefficients) / (1.0 - own_weight), inverse @ inverse.T


def _check_agreement(
    what: str, points: Sequence[GapPoint], z: FloatArray, values: FloatArray, weights: FloatArray
) -> None:
    """Raise unless every inner point agrees with the curve through the others; ends are extrapolated."""
    degree = min(3, z.size - 4)
    judged = []
    for place in range(1, z.size - 1):
        others = np.arange(z.size) != place
        coefficients, _, _ = _weighted(z[others], values[others], weights[others], degree)
        error = (values - polyval(z, coefficients)) * weights
        scatter = float(np.sqrt(np.sum(error[others] ** 2) / (z.size - degree - 2)))
        steepness = abs(float(polyval(z[place], polyder(coefficients))))
        as_gap = 0.5 * (points[-1].gap - points[0].gap) / (weights[place] * max(steepness, 1e-12))
        judged.append((abs(error[place]) / scatter, place, abs(error[place]) * as_gap, scatter * as_gap))
    times, place, off, scatter = max(judged)
    if times > _FAR and off > _CONTRADICTION:
        point = points[place]
        raise LawRefusedError(
            f'{point.name}: by the {what} its gap is {off * 1e6:.1f} um off the given '
            f'{point.gap * 1e6:.1f} um, judged by the other recordings, which agree within '
            f'{scatter * 1e6:.1f} um; is the gap of this file right? Correct it, or leave the file out'
        )
