"""Gap curves and their temperature compensation from ripple at two or more coil temperatures."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyfit

from engine_mount.identification.fitting import FloatArray
from engine_mount.identification.gap_curves import (
    CurveFit,
    GapCalibration,
    GapPoint,
    RippleRecording,
    calibrate_gap_curves,
    measured_point,
)
from engine_mount.identification.specimen import described_files, rounded, with_part
from engine_mount.recordings.screen import Screen, Table
from mount_models.coil.correction import (
    CONDUCTIVITY_COEFFICIENT,
    TemperatureCompensation,
    check_compensation,
    crossing_at_calibration,
    inductance_at_calibration,
)
from mount_models.coil.gap import GapCurves, ScaledPolynomial, evaluate
from mount_models.quantity import LawRefusedError
from mount_models.specimen import Specimen

LOWEST_CELSIUS, HIGHEST_CELSIUS = -40.0, 120.0
"""Range of coil temperatures that is compensated, degC (chosen)."""
_SAME_CELSIUS = 5.0  # K, chosen
_FEWEST_GAPS = 4
_SOURCES = {'fitted': 'measured, used by the fit', 'held out': 'measured, held out'}
_POINT = (
    'recording', 'gap_m', 'inductance_h', 'inductance_std_h', 'crossing_current_a', 'crossing_current_std_a',
)  # fmt: skip
_ERRORS = ('rest_uncompensated_um', 'rest_um', 'contact_uncompensated_um', 'contact_um')


class InductanceCalibration(NamedTuple):
    """Curves, their compensation, and what temperature leaves.

    `base` gives all other values, and where the gap is measured: `rest_current`, `crossing_inductance`.
    """

    base: Specimen
    files: Sequence[Path]
    calibration: GapCalibration
    compensation: TemperatureCompensation
    temperature_errors: list[dict[str, Any]]

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON; SI units, temperatures in degC."""
        return {
            'curves': {
                name: {
                    **fit.polynomial._asdict(),
                    'coefficient_std': np.sqrt(fit.covariance.diagonal()).tolist(),
                    'degree': len(fit.covariance) - 1,
                    'gap_rms_m': fit.gap_rms,
                    'largest_gap_std_m': fit.largest_gap_std,
                }
                for name, fit in self._fits().items()
            },
            'points': [
                dict(zip(_POINT, [name, gap, *values], strict=True))
                for name, gap, _, *values in self.calibration.points
            ],
            'temperature': {
                'compensated_by': self._compensated_by(),
                'coefficient_per_k': self.compensation.conductivity_coefficient,
                'gap_error_um': self.temperature_errors,
            },
        }

    def report(self, screen: Screen) -> None:
        """Show the residuals by gap, and what temperature leaves."""
        _, rest, contact, points = self.calibration
        rows = [
            (
                f'{point.gap * 1e6:.1f}',
                f'{point.inductance * 1e3:.3f}',
                f'{rest_error * 1e6:+.2f}',
                f'{point.crossing_current:.4f}',
                f'{contact_error * 1e6:+.2f}',
            )
            for point, rest_error, contact_error in zip(
                points, rest.gap_errors, contact.gap_errors, strict=True
            )
        ]
        heads = ('air gap (µm)', 'L at rest (mH)', 'error', 'crossing (A)', 'error')
        screen.table(Table('gap curves: error of the curve as a gap (µm)', 'rrrrr', rows, heads))
        warmth = [
            (f'{row["celsius"]:.0f}', *(f'{row[name]:.1f}' for name in _ERRORS), _SOURCES[row['source']])
            for row in self.temperature_errors
        ]
        titles = ('degC', 'at rest', 'compensated', 'at contact', 'compensated', 'from')
        screen.table(Table('largest gap error by coil temperature (µm)', 'rrrrrl', warmth, titles))
        screen.say(
            f'valid within {rest.polynomial.low * 1e6:.1f} .. {rest.polynomial.high * 1e6:.1f} um; largest '
            f'standard deviation of a gap by the curve alone {rest.largest_gap_std * 1e6:.2f} um at rest, '
            f'{contact.largest_gap_std * 1e6:.2f} um at contact'
        )
        screen.say(f'temperature compensation: {self._compensated_by()}')

    def specimen(self, name: str = '') -> Specimen:
        """Return the base under `name` with the curves and their compensation; raises `SpecimenError`."""
        curve = self.calibration.inductance.polynomial
        origin = {
            'valid': {'gap': [curve.low, curve.high]},
            'celsius': rounded(self.compensation.calibration_celsius),
            'temperature_compensation': self._compensated_by(),
            **{
                name: {
                    'degree': len(fit.covariance) - 1,
                    **{key: rounded(value) for key, value in fit._asdict().items() if key != 'polynomial'},
                }
                for name, fit in self._fits().items()
            },
        }
        return with_part(
            self.base, name, 'gap_curves', described_files(self.files), origin,
            gap_curves=self.calibration.curves, temperature=self.compensation,
        )  # fmt: skip

    def draw(self, file: Path) -> None:
        """Write the picture of the curves and what temperature leaves to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_gap_curves

        draw_gap_curves(self, file)

    def _fits(self) -> dict[str, CurveFit]:
        return {
            'inductance_of_gap': self.calibration.inductance,
            'crossing_current_of_gap': self.calibration.crossing,
        }

    def _compensated_by(self) -> str:
        own, other, *_ = self.compensation
        return (
            f'measured at {own:.0f} and {other:.0f} degC, in between by the coefficient of the core, '
            f'{self.compensation.conductivity_coefficient:g} 1/K'
        )


def calibrate_inductance(
    recordings: Sequence[RippleRecording],
    base: Specimen,
    files: Sequence[Path],
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
    held_out: Sequence[float] = (),
) -> InductanceCalibration:
    """Return the calibration by the core's `coefficient` (1/K); raises `LawRefusedError`.

    Recordings at temperatures `held_out` (degC) only judge it. A refusal names another crossing inductance
    where one serves all recordings.
    """

    def attempt(level: float) -> InductanceCalibration:
        own = replace(base, crossing_inductance=level)
        return _calibrated(recordings, own, files, coefficient, held_out)

    try:
        return attempt(base.crossing_inductance)
    except LawRefusedError as error:
        low, high = np.transpose([np.nanpercentile(each.inductance, (2, 98)) for each in recordings])
        serving = []
        # 20 of them, chosen, rounded to 0.01 mH: exactly the value that the sentence names is tried
        for level in np.round(np.linspace(low.max(), high.min(), 20), 5).tolist():
            with contextlib.suppress(LawRefusedError):
                attempt(level)
                serving.append(level)
        if not serving:
            raise
        raise LawRefusedError(
            f'{error}; --crossing-inductance {1e3 * serving[len(serving) // 2]:g} serves these recordings'
        ) from error


def measured_compensation(
    curves: GapCurves,
    celsius: float,
    points: Sequence[GapPoint],
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
) -> TemperatureCompensation:
    """Return the shifts of `points` at one other temperature against the curves at `celsius`.

    Raises `LawRefusedError` for too few gaps, or temperatures too much alike.
    """
    curve = curves.inductance_of_gap
    inside = [point for point in points if curve.low <= point.gap <= curve.high]
    if len(inside) < _FEWEST_GAPS:
        raise LawRefusedError(
            f'a temperature compensation needs recordings at {_FEWEST_GAPS} or more gaps within '
            f'{curve.low * 1e6:.0f} .. {curve.high * 1e6:.0f} um at the other temperature; {len(inside)} '
            'given: record more, or leave that temperature out'
        )
    _, gaps, degrees, inductance, _, crossing, _ = (np.array(each) for each in zip(*inside, strict=True))
    reference = float(np.mean(degrees))
    centre, scale = 0.5 * (curve.low + curve.high), 0.5 * (curve.high - curve.low)

    def shift(values: FloatArray) -> ScaledPolynomial:
        coefficients = polyfit((gaps - centre) / scale, values, 2)
        return ScaledPolynomial(centre, scale, tuple(coefficients.tolist()), curve.low, curve.high)

    compensation = TemperatureCompensation(
        calibration_celsius=celsius,
        reference_celsius=reference,
        lowest_celsius=min(LOWEST_CELSIUS, celsius, reference),
        highest_celsius=max(HIGHEST_CELSIUS, celsius, reference),
        conductivity_coefficient=coefficient,
        reluctance_shift=shift(1.0 / inductance - 1.0 / evaluate(curve, gaps)),
        crossing_shift=shift(crossing - evaluate(curves.crossing_current_of_gap, gaps)),
    )
    check_compensation(compensation, curves)
    return compensation


def gap_errors(
    curves: GapCurves, compensation: TemperatureCompensation, points: Sequence[GapPoint], source: str
) -> list[dict[str, Any]]:
    """Return for each temperature of the points the largest gap errors (um) against their known gaps.

    At rest and at contact, without and with compensation; `source` is 'fitted' or 'held out'.
    """
    rows = []
    for celsius in sorted({round(point.celsius) for point in points}):
        worst = np.zeros(4)
        for point in (each for each in points if round(each.celsius) == celsius):
            at_rest, crossing = point.inductance, point.crossing_current
            gaps = [
                evaluate(curve, value)
                for curve, plain, carried in (
                    (curves.gap_of_inductance, at_rest, inductance_at_calibration),
                    (curves.gap_of_crossing_current, crossing, crossing_at_calibration),
                )
                for value in (plain, carried(compensation, curves, plain, celsius))
            ]
            worst = np.maximum(worst, 1e6 * np.abs(np.array(gaps) - point.gap))
        figures = {name: float(f'{value:.3g}') for name, value in zip(_ERRORS, worst, strict=True)}
        rows.append({'celsius': float(celsius), 'source': source, **figures})
    return rows


def _calibrated(
    recordings: Sequence[RippleRecording],
    base: Specimen,
    files: Sequence[Path],
    coefficient: float,
    held_out: Sequence[float],
) -> InductanceCalibration:
    points = [measured_point(each, base.rest_current, base.crossing_inductance) for each in recordings]
    unseen = [point for point in points if any(_is_alike(point.celsius, celsius) for celsius in held_out)]
    fitted = [point for point in points if point not in unseen]
    groups: dict[float, list[GapPoint]] = {}
    for point in sorted(fitted, key=lambda each: each.celsius):
        near = [key for key in groups if _is_alike(key, point.celsius)]
        groups.setdefault(near[-1] if near else point.celsius, []).append(point)
    if not groups:
        raise LawRefusedError(
            f'all {len(points)} recordings are held out; leave those out of --held-out-temperature that the '
            'curves shall be fitted to'
        )
    own = max(groups, key=lambda celsius: (len(groups[celsius]), -abs(celsius - 20.0)))
    calibration = calibrate_gap_curves(groups.pop(own))
    if not groups:
        raise LawRefusedError(
            f'all recordings are at one coil temperature ({own:.0f} degC), and it moves the gap that is '
            f'read: record {_FEWEST_GAPS} or more gaps at a second temperature too'
        )
    celsius = float(np.mean([point.celsius for point in calibration.points]))
    other = groups[max(groups, key=lambda key: (len(groups[key]), abs(key - own)))]
    compensation = measured_compensation(calibration.curves, celsius, other, coefficient)
    errors = gap_errors(calibration.curves, compensation, fitted, 'fitted')
    errors += gap_errors(calibration.curves, compensation, unseen, 'held out')
    return InductanceCalibration(base, files, calibration, compensation, errors)


def _is_alike(one: float, other: float) -> bool:
    return abs(one - other) <= _SAME_CELSIUS
