"""Gap curves with their uncertainty through ripple recorded at known gaps, and their inverses (Fig. 4)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyfit, polyval, polyvander
from scipy.stats import linregress, sem

from engine_mount.identification.fitting import FloatArray, rms, single_threaded
from mount_models.coil.crossing import CrossingError, find_crossing
from mount_models.coil.gap import GapCurves, ScaledPolynomial, check_gap_curves, evaluate, slope
from mount_models.quantity import LawRefusedError

_FEWEST_AT_REST = 20  # chosen
_REST_HALF_WIDTH = 0.02  # A, chosen: there the inductance is straight over the current
_CROSSING_HALF_WIDTH = 0.2  # A, chosen
_FEWEST_GAPS = 6  # chosen: a cubic and two to judge it
_HIGHEST_DEGREE = 5  # chosen
_CONTRADICTION = 3e-6  # m, chosen: below it a point is as good as its gap could be set
_FAR = 10.0  # standard deviations, chosen: few points are a poor measure of their scatter
_NEARLY = 1.1  # chosen
_INVERSE_ERROR = 0.05e-6  # m
_GRID = np.linspace(-1.0, 1.0, 101)  # of a curve, over its scaled gap
_BEYOND_DOUBT = 2.0  # standard deviations, chosen


class RippleRecording(NamedTuple):
    """Ripple at one gap (m) and coil temperature (degC): currents (A) and inductances (H), shape (N,)."""

    name: str
    gap: float
    celsius: float
    current: FloatArray
    inductance: FloatArray


class GapPoint(NamedTuple):
    """One recording: inductance at rest (H) and crossing current (A) with their standard deviations."""

    name: str
    gap: float
    celsius: float
    inductance: float
    inductance_std: float
    crossing_current: float
    crossing_current_std: float


class CurveFit(NamedTuple):
    """A curve over the gap, the covariance of its coefficients, and its errors at the points as gaps (m).

    `largest_gap_std` (m) is the largest standard deviation of a gap read from it, by the curve alone.
    """

    polynomial: ScaledPolynomial
    covariance: FloatArray
    gap_errors: FloatArray
    gap_rms: float
    largest_gap_std: float


class GapCalibration(NamedTuple):
    """The four curves of the controller, and the two fits over the gap that they come from."""

    curves: GapCurves
    inductance: CurveFit
    crossing: CurveFit
    points: tuple[GapPoint, ...]


def measured_point(
    recording: RippleRecording, rest_current: float = 0.2, crossing_inductance: float = 20e-3
) -> GapPoint:
    """Return L_0.2 and i_20 of one recording; raises `LawRefusedError` naming it."""
    name, gap, celsius, current, inductance = recording
    near = (np.abs(current - rest_current) <= _REST_HALF_WIDTH) & np.isfinite(inductance)
    if near.sum() < _FEWEST_AT_REST:
        raise LawRefusedError(
            f'{name}: samples within {_REST_HALF_WIDTH:.2f} A of the rest current ({rest_current:.2f} A) '
            f'must be at least {_FEWEST_AT_REST}, {int(near.sum())} are: '
            'a table of few points is not enough; record the ripple, and hold that current for longer'
        )
    at_rest = _rest_inductance((current[near] - rest_current) / _REST_HALF_WIDTH, inductance[near])
    try:
        crossing = find_crossing(current, inductance, crossing_inductance, _CROSSING_HALF_WIDTH)
    except CrossingError as error:
        raise LawRefusedError(f'{name}: {error}') from error
    return GapPoint(name, gap, celsius, *at_rest, crossing.current, crossing.current_std)


def _rest_inductance(z: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Return the inductance (H) at the rest current and its std: a line through the samples around it."""
    deviation = np.abs(values - np.median(values))
    kept = deviation <= max(4.0 * 1.4826 * np.median(deviation), 0.02 * abs(np.median(values)))
    z, values = z[kept], values[kept]
    if np.ptp(z) < 0.1:  # the current was held: nothing to be said of a slope
        return float(values.mean()), float(sem(values))
    line = linregress(z, values)
    return float(line.intercept), float(line.intercept_stderr)


@single_threaded
def calibrate_gap_curves(points: Sequence[GapPoint]) -> GapCalibration:
    """Return the curves through points at one temperature, both ways.

    The degree is the lowest that predicts each point from the others nearly as well as the best one. Raises
    `LawRefusedError` for too few gaps, a point that contradicts the others, or a curve that does not tell
    gaps apart.
    """
    points = sorted(points, key=lambda point: point.gap)
    gaps = np.array([point.gap for point in points])
    if gaps.size < _FEWEST_GAPS or np.any(np.diff(gaps) < 1e-6):
        raise LawRefusedError(
            f'gap curves need recordings at {_FEWEST_GAPS} or more air gaps that differ by 1 um or more; '
            f'{gaps.size} given: {", ".join(f"{gap * 1e6:.1f}" for gap in gaps)} um: record more gaps, and '
            'each temperature and gap once'
        )
    inductance = _fit_curve('inductance at the rest current', points, 'inductance')
    crossing = _fit_curve('crossing current', points, 'crossing_current')
    curves = GapCurves(
        inductance.polynomial,
        _inverse_curve(inductance.polynomial),
        crossing.polynomial,
        _inverse_curve(crossing.polynomial),
    )
    check_gap_curves(curves)
    return GapCalibration(curves, inductance, crossing, tuple(points))


def _fit_curve(what: str, points: Sequence[GapPoint], name: str) -> CurveFit:
    """Return the curve through the values `name` of `points`, in words `what`, over their gaps."""
    gaps, values, stds = (
        np.array([getattr(point, each) for point in points]) for each in ('gap', name, f'{name}_std')
    )
    low, high = float(gaps.min()), float(gaps.max())
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    z = (gaps - centre) / scale
    floor = 1e-6 * np.median(np.abs(values))
    weights = 1.0 / np.hypot(np.hypot(stds, np.median(stds)), floor)
    _check_agreement(what, points, z, values, weights)
    trials = []
    for degree in range(2, min(_HIGHEST_DEGREE, gaps.size - 3) + 1):
        coefficients, left_out, unscaled = _weighted(z, values, weights, degree)
        trials.append((rms(left_out * weights), coefficients, unscaled))
    best = min(trial[0] for trial in trials)
    _, coefficients, unscaled = next(trial for trial in trials if trial[0] <= _NEARLY * best)
    polynomial = ScaledPolynomial(centre, scale, tuple(coefficients.tolist()), low, high)
    off = evaluate(polynomial, gaps) - values
    errors = off / np.maximum(np.abs(slope(polynomial, gaps)), 1e-12)
    scatter = np.sum((off * weights) ** 2) / (gaps.size - coefficients.size)
    covariance = max(scatter, 1e-3) * unscaled
    slopes = slope(polynomial, np.linspace(low, high, _GRID.size))
    _check_slopes(what, polynomial, slopes, covariance)
    powers = polyvander(_GRID, coefficients.size - 1)
    gap_std = _deviations(powers, covariance) / np.maximum(np.abs(slopes), 1e-12)
    return CurveFit(polynomial, covariance, errors, rms(errors), float(np.max(gap_std)))


def _deviations(rows: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the standard deviations of the products of `rows` with coefficients of that covariance."""
    return np.sqrt(np.einsum('ij,jk,ik->i', rows, covariance, rows))


def _check_slopes(what: str, curve: ScaledPolynomial, slopes: FloatArray, covariance: FloatArray) -> None:
    """Raise `LawRefusedError` unless the curve rises, or falls, with the gap beyond doubt of its scatter."""
    orders = np.arange(len(covariance))
    powers = orders * _GRID[:, np.newaxis] ** np.maximum(orders - 1, 0)
    unsure = _BEYOND_DOUBT * _deviations(powers, covariance) / curve.scale
    doubtful = np.sign(slopes[slopes.size // 2]) * slopes <= unsure
    if doubtful.any():
        raise LawRefusedError(
            f'the {what} must rise or fall steadily with the gap to separate gaps; at '
            f'{1e6 * (curve.centre + curve.scale * _GRID[np.argmax(doubtful)]):.0f} um it does not, beyond '
            f'{_BEYOND_DOUBT:g} standard deviations: narrow the range of gaps'
        )


def _inverse_curve(polynomial: ScaledPolynomial) -> ScaledPolynomial:
    """Return the gap over the value of the curve, exact to `_INVERSE_ERROR` where a polynomial can be."""
    gaps = np.linspace(polynomial.low, polynomial.high, 201)
    values = evaluate(polynomial, gaps)
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
        scatter = np.sqrt(np.sum(error[others] ** 2) / (z.size - degree - 2))
        steepness = abs(polyval(z[place], polyder(coefficients)))
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
