"""Fit the gap curves of `coil.gap` to measurements at fixed gaps, in both directions."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mount_models.coil.gap import (
    GapCurves,
    GapCurvesRefusedError,
    ScaledPolynomial,
    check_gap_curves,
    evaluate,
    slope,
)

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class GapCurvesFit:
    """Fitted curves; by the name of each its degree, and its largest error as a gap (m)."""

    curves: GapCurves
    largest_gap_error: dict[str, float]
    degree: dict[str, int]


def fit_gap_curves(
    gap: npt.ArrayLike,
    inductance_at_rest_current: npt.ArrayLike,
    crossing_current: npt.ArrayLike,
    gap_error: float = 0.1e-6,
    highest_degree: int = 6,
) -> GapCurvesFit:
    """Return the curves through inductances (H) and crossing currents (A) measured at gaps (m); shapes (G,).

    Cubic, or of the first higher degree that meets every point within `gap_error` (m). Noisy measurements
    meet that at no degree: then the degree is taken that best predicts each point from all others.
    Raises `GapCurvesRefusedError` for too few or failed points, and for a curve that is not monotone.
    """
    gaps, inductances, crossings = (
        np.asarray(values, float) for values in (gap, inductance_at_rest_current, crossing_current)
    )
    _check_points(gaps, inductances, crossings)
    pairs = {
        'inductance_of_gap': (gaps, inductances),
        'gap_of_inductance': (inductances, gaps),
        'crossing_current_of_gap': (gaps, crossings),
        'gap_of_crossing_current': (crossings, gaps),
    }
    found, errors, degrees = {}, {}, {}
    for name, (x, y) in pairs.items():
        found[name], errors[name] = _fitted(x, y, gaps is y, gap_error, highest_degree)
        degrees[name] = len(found[name].coefficients) - 1
    curves = GapCurves(**found)
    check_gap_curves(curves)
    return GapCurvesFit(curves, errors, degrees)


def _fitted(
    x: FloatArray, y: FloatArray, y_is_gap: bool, gap_error: float, highest_degree: int
) -> tuple[ScaledPolynomial, float]:
    """Return the polynomial y(x) of the degree told in `fit_gap_curves`, and its largest error as a gap."""
    candidates = []
    for degree in range(3, min(highest_degree, x.size // 2) + 1):
        polynomial, left_out_error = _least_squares(x, y, degree)
        error = np.abs(evaluate(polynomial, x) - y)
        as_gap = error if y_is_gap else error / np.abs(slope(polynomial, x))
        largest = float(as_gap.max())
        if largest <= gap_error:
            return polynomial, largest
        candidates.append((left_out_error, degree, polynomial, largest))
    _, _, polynomial, largest = min(candidates)
    return polynomial, largest


def _least_squares(x: FloatArray, y: FloatArray, degree: int) -> tuple[ScaledPolynomial, float]:
    """Return the polynomial of `degree`, and the rms error of each point as the others predict it."""
    low, high = float(x.min()), float(x.max())
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    powers = np.polynomial.polynomial.polyvander((x - centre) / scale, degree)
    orthogonal, triangle = np.linalg.qr(powers)
    coefficients = np.linalg.solve(triangle, orthogonal.T @ y)
    own_weight = np.sum(orthogonal**2, axis=1)
    left_out = (y - powers @ coefficients) / (1.0 - own_weight)
    polynomial = ScaledPolynomial(centre, scale, tuple(float(value) for value in coefficients), low, high)
    return polynomial, float(np.sqrt(np.mean(left_out**2)))


def _check_points(gaps: FloatArray, inductances: FloatArray, crossings: FloatArray) -> None:
    if gaps.ndim != 1 or gaps.shape != inductances.shape or gaps.shape != crossings.shape:
        raise GapCurvesRefusedError(
            f'gaps, inductances and crossing currents must be three rows of one length; instead received '
            f'shapes {gaps.shape}, {inductances.shape}, {crossings.shape}'
        )
    if gaps.size < 8 or np.unique(gaps).size < gaps.size:
        raise GapCurvesRefusedError(
            f'gap curves need at least 8 different air gaps; {np.unique(gaps).size} are given: measure more'
        )
    if not np.isfinite([gaps, inductances, crossings]).all():
        raise GapCurvesRefusedError('gap measurements must be finite; leave out the gaps that failed')
