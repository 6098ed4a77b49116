"""A curve over the gap through points, with its uncertainty, and its inverse."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_mount.identification.coil.gap_point import GapPoint
from mount_models.coil.gap import ScaledPolynomial, evaluate, slope
from mount_models.quantity import LawRefusedError

FloatArray = npt.NDArray[np.float64]


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


def fitted_curve(
    what: str, points: Sequence[GapPoint], values: FloatArray, stds: FloatArray, highest_degree: int
) -> CurveFit:
    """Return the curve through `values` (n,) with deviations `stds` (n,) at the gaps of `points`.

    The degree is the lowest that predicts each point from the others nearly as well as the best one. Raises
    `LawRefusedError`, which names the value by `what`, for a point that contradicts the others.
    """
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
    polynomial = ScaledPolynomial(centre, scale, tuple(float(value) for value in coefficients), low, high)
    steepness = np.abs(slope(polynomial, gaps))
    errors = (evaluate(polynomial, gaps) - values) / np.maximum(steepness, 1e-12)
    freedom = gaps.size - coefficients.size
    scatter = float(np.sum(((evaluate(polynomial, gaps) - values) * weights) ** 2)) / freedom
    covariance = max(scatter, 1e-3) * unscaled
    dense = np.polynomial.polynomial.polyvander(np.linspace(-1.0, 1.0, 101), coefficients.size - 1)
    band = np.sqrt(np.einsum('ij,jk,ik->i', dense, covariance, dense))
    steep = np.abs(slope(polynomial, np.linspace(low, high, 101)))
    return CurveFit(
        polynomial,
        covariance,
        errors,
        float(np.sqrt(np.mean(errors**2))),
        float(np.max(band / np.maximum(steep, 1e-12))),
    )


def inverse_curve(what: str, polynomial: ScaledPolynomial) -> ScaledPolynomial:
    """Return the gap over the value of the curve, exact to `_INVERSE_ERROR` where a polynomial can be.

    Raises `LawRefusedError` for a curve that is not monotone.
    """
    gaps = np.linspace(polynomial.low, polynomial.high, 201)
    values = evaluate(polynomial, gaps)
    steps = np.diff(values)
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        place = int(np.argmax(np.sign(steps) != np.sign(steps[steps.size // 2])))
        raise LawRefusedError(
            f'the {what} must rise or fall steadily with the gap to tell gaps apart; it turns at '
            f'{gaps[place] * 1e6:.0f} um: narrow the range of gaps, or choose another rest current or '
            f'crossing inductance'
        )
    low, high = float(values.min()), float(values.max())
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    z = (values - centre) / scale
    for degree in range(3, 10):
        coefficients = np.polynomial.polynomial.polyfit(z, gaps, degree)
        error = np.abs(np.polynomial.polynomial.polyval(z, coefficients) - gaps).max()
        if error <= _INVERSE_ERROR:
            break
    return ScaledPolynomial(centre, scale, tuple(float(value) for value in coefficients), low, high)


_CONTRADICTION = 3e-6  # m, chosen: below it a point is as good as its gap could be set
_FAR = 10.0  # standard deviations, chosen: few points tell their scatter badly
_NEARLY = 1.1  # chosen
_INVERSE_ERROR = 0.05e-6  # m


def _weighted(
    z: FloatArray, values: FloatArray, weights: FloatArray, degree: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return coefficients, the error of each point as the others predict it, and the plain covariance."""
    powers = np.polynomial.polynomial.polyvander(z, degree)
    orthogonal, triangle = np.linalg.qr(powers * weights[:, np.newaxis])
    coefficients = np.linalg.solve(triangle, orthogonal.T @ (values * weights))
    own_weight = np.minimum(np.sum(orthogonal**2, axis=1), 0.99)
    inverse = np.linalg.inv(triangle)
    return coefficients, (values - powers @ coefficients) / (1.0 - own_weight), inverse @ inverse.T


def _check_agreement(
    what: str, points: Sequence[GapPoint], z: FloatArray, values: FloatArray, weights: FloatArray
) -> None:
    """Raise unless every inner point lies where the curve through the others says; ends are extrapolated."""
    degree = min(3, z.size - 4)
    judged = []
    for place in range(1, z.size - 1):
        others = np.arange(z.size) != place
        coefficients, _, _ = _weighted(z[others], values[others], weights[others], degree)
        error = (values - np.polynomial.polynomial.polyval(z, coefficients)) * weights
        scatter = float(np.sqrt(np.sum(error[others] ** 2) / (z.size - degree - 2)))
        steepness = abs(float(np.polynomial.polynomial.polyval(z[place], _derived(coefficients))))
        as_gap = 0.5 * (points[-1].gap - points[0].gap) / (weights[place] * max(steepness, 1e-12))
        judged.append((abs(error[place]) / scatter, place, abs(error[place]) * as_gap, scatter * as_gap))
    times, place, off, scatter = max(judged)
    if times > _FAR and off > _CONTRADICTION:
        point = points[place]
        raise LawRefusedError(
            f'{point.name}: the {what} says that its gap is {off * 1e6:.1f} um off the given '
            f'{point.gap * 1e6:.1f} um, judged by the other recordings, which agree within '
            f'{scatter * 1e6:.1f} um; is the gap of this file right? Correct it, or leave the file out'
        )


def _derived(coefficients: FloatArray) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyder(coefficients))
