"""Gap curves with their uncertainty from ripple recorded at known gaps, one recording for each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mount_identification.coil.few_points import (
    MOST_POINTS,
    InductanceTable,
    TableError,
    falling_sentence,
)
from mount_identification.single_threaded import single_threaded
from mount_models.coil.crossing import CrossingError, find_crossing
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
class RippleRecording:
    """Ripple at one gap (m) and coil temperature (degC): currents (A) and inductances (H), shape (N,)."""

    name: str
    gap: float
    celsius: float
    current: FloatArray
    inductance: FloatArray


@dataclass(frozen=True)
class GapPoint:
    """What one recording says: L_0.2 (H) and i_20 (A) with standard deviations, dL/di there (H/A)."""

    name: str
    gap: float
    celsius: float
    inductance: float
    inductance_std: float
    crossing_current: float
    crossing_std: float
    crossing_slope: float
    table: tuple[float, float] | None = None
    """Lowest and highest current (A) of a table of few points that it was interpolated from."""


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
    """The four curves that the controller takes, and the two fits over the gap that they come from."""

    curves: GapCurves
    inductance: CurveFit
    crossing: CurveFit
    points: tuple[GapPoint, ...]


def measured_point(
    recording: RippleRecording,
    rest_current: float = 0.2,
    crossing_inductance: float = 20e-3,
    crossing_half_width: float = 0.2,
) -> GapPoint:
    """Return L_0.2 and i_20 of one recording; raises `GapCurvesRefusedError` naming it."""
    current, inductance = recording.current, recording.inductance
    if is_table(recording, rest_current):
        return _from_table(recording, rest_current, crossing_inductance)
    finite = np.isfinite(current) & np.isfinite(inductance)
    at_rest, rest_std = _rest_inductance(recording.name, current[finite], inductance[finite], rest_current)
    try:
        crossing = find_crossing(current, inductance, crossing_inductance, crossing_half_width)
    except CrossingError as error:
        steps = in_steps(recording)
        beyond = steps[1].max() < crossing_inductance or steps[1].min() > crossing_inductance
        sentence = falling_sentence(*steps, crossing_inductance) if beyond else error
        raise GapCurvesRefusedError(f'{recording.name}: {sentence}') from error
    return GapPoint(
        recording.name,
        recording.gap,
        recording.celsius,
        at_rest,
        rest_std,
        crossing.current,
        crossing.current_std,
        crossing.inductance_slope,
    )


def is_table(recording: RippleRecording, rest_current: float) -> bool:
    """Return whether it holds few points, as a table does, rather than samples of a ramp."""
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    held = np.abs(recording.current[finite] - rest_current) <= _REST_HALF_WIDTH
    return bool(finite.sum() <= MOST_POINTS and held.sum() < _FEWEST_AT_REST)


def in_steps(recording: RippleRecording) -> tuple[FloatArray, FloatArray]:
    """Return means of currents (A), rising, and inductances (H) over up to 20 like parts of a recording."""
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    order = np.argsort(recording.current[finite], kind='stable')
    parts = np.array_split(order, min(_STEPS, order.size))
    current, inductance = recording.current[finite], recording.inductance[finite]
    return (
        np.array([current[part].mean() for part in parts]),
        np.array([inductance[part].mean() for part in parts]),
    )


@single_threaded
def calibrate_gap_curves(points: Sequence[GapPoint], highest_degree: int = 5) -> GapCalibration:
    """Return the curves through points at one temperature, both ways.

    The degree is the lowest that predicts each point from the others nearly as well as the best one. Raises
    `GapCurvesRefusedError` for too few gaps, a point that contradicts the others, or curves not monotone.
    """
    points = sorted(points, key=lambda point: point.gap)
    gaps = np.array([point.gap for point in points])
    _check_gaps(gaps)

    def fitted(what: str, value: str, std: str) -> CurveFit:
        values, stds = (np.array([getattr(point, name) for point in points]) for name in (value, std))
        return _fit(what, points, values, stds, highest_degree)

    inductance = fitted(_INDUCTANCE, 'inductance', 'inductance_std')
    crossing = fitted(_CROSSING, 'crossing_current', 'crossing_std')
    curves = GapCurves(
        inductance.polynomial,
        _inverse(_INDUCTANCE, inductance.polynomial),
        crossing.polynomial,
        _inverse(_CROSSING, crossing.polynomial),
    )
    check_gap_curves(curves)
    return GapCalibration(curves, inductance, crossing, tuple(points))


_INDUCTANCE, _CROSSING = 'inductance at the rest current', 'crossing current'
_STEPS = 20  # chosen: enough to see rise and fall
_FEWEST_AT_REST = 20  # chosen
_REST_HALF_WIDTH = 0.02  # A, chosen: there the inductance is straight over the current
_FEWEST_GAPS = 6  # chosen: a cubic and two to judge it
_CONTRADICTION = 3e-6  # m, chosen: below it a point is as good as its gap could be set
_FAR = 10.0  # standard deviations, chosen: few points tell their scatter badly
_NEARLY = 1.1  # chosen
_INVERSE_ERROR = 0.05e-6  # m


def _from_table(recording: RippleRecording, rest_current: float, crossing_inductance: float) -> GapPoint:
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    try:
        table = InductanceTable(recording.current[finite], recording.inductance[finite])
        at_rest, rest_std = table.at(rest_current)
        crossing, crossing_std, crossing_slope = table.falls_through(crossing_inductance)
    except TableError as error:
        raise GapCurvesRefusedError(f'{recording.name}: {error}') from error
    return GapPoint(
        recording.name, recording.gap, recording.celsius, at_rest, rest_std, crossing, crossing_std,
        crossing_slope, (float(table.current[0]), float(table.current[-1])),
    )  # fmt: skip


def _rest_inductance(
    name: str, current: FloatArray, inductance: FloatArray, rest_current: float
) -> tuple[float, float]:
    """Return the inductance (H) at the rest current and its std: a line through the samples around it."""
    near = np.abs(current - rest_current) <= _REST_HALF_WIDTH
    if near.sum() < _FEWEST_AT_REST:
        raise GapCurvesRefusedError(
            f'{name}: samples within {_REST_HALF_WIDTH:.2f} A of the rest current ({rest_current:.2f} A) '
            f'must be at least {_FEWEST_AT_REST}, {int(near.sum())} are; hold that current for longer'
        )
    z, values = (current[near] - rest_current) / _REST_HALF_WIDTH, inductance[near]
    deviation = np.abs(values - np.median(values))
    kept = deviation <= max(4.0 * 1.4826 * float(np.median(deviation)), 0.02 * abs(float(np.median(values))))
    z, values = z[kept], values[kept]
    powers = np.stack([np.ones_like(z), z], axis=1)
    if np.ptp(z) < 0.1:
        powers = powers[:, :1]  # the current was held: nothing to be said of a slope
    solution, *_ = np.linalg.lstsq(powers, values, rcond=None)
    scatter = float(np.sum((values - powers @ solution) ** 2)) / max(1, values.size - powers.shape[1])
    spread = float(np.linalg.inv(powers.T @ powers)[0, 0])
    return float(solution[0]), math.sqrt(scatter * spread)


def _check_gaps(gaps: FloatArray) -> None:
    if gaps.size < _FEWEST_GAPS or np.any(np.diff(gaps) < 1e-6):
        raise GapCurvesRefusedError(
            f'gap curves need recordings at {_FEWEST_GAPS} or more air gaps that differ by 1 um or more; '
            f'{gaps.size} given: {", ".join(f"{gap * 1e6:.1f}" for gap in gaps)} um: record more gaps, and '
            f'each temperature and gap once'
        )


def _fit(
    what: str, points: Sequence[GapPoint], values: FloatArray, stds: FloatArray, highest_degree: int
) -> CurveFit:
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
        raise GapCurvesRefusedError(
            f'{point.name}: the {what} says that its gap is {off * 1e6:.1f} um off the given '
            f'{point.gap * 1e6:.1f} um, judged by the other recordings, which agree within '
            f'{scatter * 1e6:.1f} um; is the gap of this file right? Correct it, or leave the file out'
        )


def _derived(coefficients: FloatArray) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyder(coefficients))


def _inverse(what: str, polynomial: ScaledPolynomial) -> ScaledPolynomial:
    """Return the gap over the value of the curve, exact to `_INVERSE_ERROR` where a polynomial can be."""
    gaps = np.linspace(polynomial.low, polynomial.high, 201)
    values = evaluate(polynomial, gaps)
    steps = np.diff(values)
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        place = int(np.argmax(np.sign(steps) != np.sign(steps[steps.size // 2])))
        raise GapCurvesRefusedError(
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
