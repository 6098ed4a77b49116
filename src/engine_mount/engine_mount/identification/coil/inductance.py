"""Gap curves from ripple recordings at one or more coil temperatures, with all that is to be said of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.identification.coil.few_points import levels_of_all
from engine_mount.identification.coil.gap_calibration import GapCalibration, calibrate_gap_curves
from engine_mount.identification.coil.gap_point import GapPoint, RippleRecording, in_steps, measured_point
from engine_mount.identification.coil.temperature_fit import measured_compensation, stated_compensation
from engine_mount.identification.coil.temperature_left import COEFFICIENT_ERROR, measured, predicted
from engine_mount.identification.coil.unique_region import UniqueRegion, unique_region, warnings
from engine_mount.recordings.screen import Table
from mount_models.actuator.law import ForceLaw
from mount_models.coil.temperature import TemperatureCompensation
from mount_models.quantity import LawRefusedError, OutsideLawError


@dataclass(frozen=True)
class GapOrder:
    """Where the gap is measured: A and H; the core's coefficient (1/K); temperatures (degC) held out."""

    rest_current: float
    crossing_inductance: float
    coefficient: float
    held_out: tuple[float, ...] = ()


@dataclass(frozen=True)
class InductanceResult:
    """Curves, their compensation and how it came about, what is unique, and what temperature leaves."""

    calibration: GapCalibration
    compensation: TemperatureCompensation | None
    compensated_by: str
    region: UniqueRegion
    left: list[dict[str, Any]]
    warnings: list[str]

    def tables(self) -> list[Table]:
        """Return the residuals by gap, and what temperature leaves."""
        return [self._residuals(), self._temperatures()]

    def sentences(self) -> list[str]:
        """Return what the figures say."""
        inductance, crossing = self.calibration.inductance, self.calibration.crossing
        curve = inductance.polynomial
        return [
            f'valid within {curve.low * 1e6:.1f} .. {curve.high * 1e6:.1f} um; largest standard deviation '
            f'of a gap by the curve alone {inductance.largest_gap_std * 1e6:.2f} um at rest, '
            f'{crossing.largest_gap_std * 1e6:.2f} um at contact',
            f'the inductance tells the gap at {_intervals(self.region.falling, 1.0)} A (falls with the gap) '
            f'and {_intervals(self.region.rising, 1.0)} A (rises), and by its current at '
            f'{_intervals(self.region.levels, 1e3)} mH; elsewhere it is ambiguous or unknown',
            f'temperature compensation: {self.compensated_by}',
            *_of_tables(self.calibration.points),
            *([_OPTIMISTIC] if any(row['source'] == 'predicted' for row in self.left) else []),
        ]

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON; SI units, temperatures in degC."""
        fits = {
            'inductance_of_gap': self.calibration.inductance,
            'crossing_current_of_gap': self.calibration.crossing,
        }
        return {
            'curves': {
                name: {
                    **fit.polynomial._asdict(),
                    'coefficient_std': np.sqrt(fit.covariance.diagonal()).tolist(),
                    'degree': fit.degree,
                    'gap_rms_m': fit.gap_rms,
                    'largest_gap_std_m': fit.largest_gap_std,
                }
                for name, fit in fits.items()
            },
            'points': [
                {
                    'recording': point.name,
                    'gap_m': point.gap,
                    'inductance_h': point.inductance,
                    'inductance_std_h': point.inductance_std,
                    'crossing_current_a': point.crossing_current,
                    'crossing_current_std_a': point.crossing_std,
                }
                for point in self.calibration.points
            ],
            'unique': {
                'falling_a': self.region.falling,
                'rising_a': self.region.rising,
                'inductance_h': self.region.levels,
            },
            'temperature': {
                'compensated_by': self.compensated_by,
                'coefficient_per_k': None
                if self.compensation is None
                else self.compensation.conductivity_coefficient,
                'gap_error_um': self.left,
            },
            'warnings': self.warnings,
        }

    def _residuals(self) -> Table:
        points, inductance = self.calibration.points, self.calibration.inductance
        errors = zip(points, inductance.gap_errors, self.calibration.crossing.gap_errors, strict=True)
        rows = [
            (
                f'{point.gap * 1e6:.1f}',
                f'{point.inductance * 1e3:.3f}',
                f'{rest * 1e6:+.2f}',
                f'{point.crossing_current:.4f}',
                f'{contact * 1e6:+.2f}',
            )
            for point, rest, contact in errors
        ]
        heads = ('air gap (µm)', 'L at rest (mH)', 'error', 'crossing (A)', 'error')
        return Table('gap curves: error of the curve as a gap (µm)', 'rrrrr', rows, heads)

    def _temperatures(self) -> Table:
        names = ('rest_uncompensated_um', 'rest_um', 'contact_uncompensated_um', 'contact_um')
        rows = [
            (f'{row["celsius"]:.0f}', *(f'{row[name]:.1f}' for name in names), _SOURCES[row['source']])
            for row in self.left
        ]
        heads = ('degC', 'at rest', 'compensated', 'at contact', 'compensated', 'from')
        return Table('largest gap error by coil temperature (µm)', 'rrrrrl', rows, heads)


def calibrate_inductance(
    recordings: Sequence[RippleRecording], law: ForceLaw, order: GapOrder
) -> InductanceResult:
    """Return the calibration; raises `LawRefusedError`."""
    points = _points(recordings, order)
    fitted = [point for point in points if not _is_held_out(point, order)]
    by_temperature = _by_temperature(fitted)
    if not by_temperature:
        raise LawRefusedError(
            f'all {len(points)} recordings are held out; leave those out of --held-out-temperature that the '
            f'curves shall be fitted to'
        )
    own = max(by_temperature, key=lambda celsius: (len(by_temperature[celsius]), -abs(celsius - 20.0)))
    used = [each for each, point in zip(recordings, points, strict=True) if point in by_temperature[own]]
    region = unique_region(used)
    found = warnings(region, order.rest_current, order.crossing_inductance)
    try:
        calibration = calibrate_gap_curves(by_temperature[own])
    except LawRefusedError as error:
        raise LawRefusedError('; '.join([str(error), *found])) from error
    celsius = float(np.mean([point.celsius for point in by_temperature[own]]))
    others = {key: group for key, group in by_temperature.items() if key != own}

    def of_coefficient(value: float) -> TemperatureCompensation:
        if others:
            reference = max(others, key=lambda key: (len(others[key]), abs(key - own)))
            return measured_compensation(calibration.curves, celsius, others[reference], value)
        return stated_compensation(
            calibration.curves,
            celsius,
            _inside(law, calibration.points),
            law,
            order.rest_current,
            order.crossing_inductance,
            value,
        )

    compensation: TemperatureCompensation | None = None
    try:
        compensation = of_coefficient(order.coefficient)
        how = _how(bool(others), compensation)
    except (LawRefusedError, OutsideLawError) as error:
        if others:
            raise
        how = 'none'
        found.append(f'coil temperature is not compensated: {error}')
    left = measured(calibration.curves, compensation, fitted, 'fitted')
    left += measured(
        calibration.curves, compensation, [p for p in points if _is_held_out(p, order)], 'held out'
    )
    if compensation is not None:
        left += predicted(calibration.curves, compensation, of_coefficient)
    return InductanceResult(calibration, compensation, how, region, left, found)


def _points(recordings: Sequence[RippleRecording], order: GapOrder) -> list[GapPoint]:
    """Return the point of each recording; a refusal names the inductances that all of them fall through."""
    try:
        return [measured_point(each, order.rest_current, order.crossing_inductance) for each in recordings]
    except LawRefusedError as error:
        low, high = levels_of_all([in_steps(each) for each in recordings])
        if 'fall through' not in str(error) or not low < high:
            raise
        raise LawRefusedError(
            f'{error}; all {len(recordings)} recordings fall through {low * 1e3:.1f} .. {high * 1e3:.1f} mH'
        ) from error


def _of_tables(points: Sequence[GapPoint]) -> list[str]:
    """Return what is to be said of points that were interpolated from tables of few points."""
    tables = [point for point in points if point.table is not None]
    if not tables:
        return []
    low, high = max(point.table[0] for point in tables), min(point.table[1] for point in tables)
    rest, contact = (
        max(getattr(each, name) for each in tables) for name in ('inductance_std', 'crossing_std')
    )
    return [
        f'{len(tables)} of {len(points)} recordings are tables of few points, measured within {low:.2f} .. '
        f'{high:.2f} A: in between by interpolation, good to {rest * 1e3:.2g} mH at rest and to '
        f'{contact * 1e3:.2g} mA of the crossing current, by how well the points predict each other'
    ]


_OPTIMISTIC = (
    'rows marked predicted are optimistic: they hold the error of a wrong coefficient of the core alone, not '
    'that of the skin formula, which only recordings held out at that temperature show'
)
_SAME_CELSIUS = 5.0  # K, chosen
_SOURCES = {
    'fitted': 'measured, used by the fit',
    'held out': 'measured, held out',
    'predicted': f'predicted, coefficient off by up to {COEFFICIENT_ERROR:.0%}',
}


def _how(measured_at_two: bool, compensation: TemperatureCompensation) -> str:
    coefficient = f'{compensation.conductivity_coefficient:g} 1/K'
    if measured_at_two:
        return (
            f'measured at {compensation.calibration_celsius:.0f} and '
            f'{compensation.reference_celsius:.0f} degC, in '
            f'between by the coefficient of the core, {coefficient}'
        )
    return (
        f'stated: coefficient of the core {coefficient}, share of the core from the force law; recordings at '
        'a second temperature would measure it'
    )


def _is_held_out(point: GapPoint, order: GapOrder) -> bool:
    return any(abs(point.celsius - celsius) <= _SAME_CELSIUS for celsius in order.held_out)


def _by_temperature(points: Sequence[GapPoint]) -> dict[float, list[GapPoint]]:
    """Return the points in groups of one temperature (degC)."""
    groups: dict[float, list[GapPoint]] = {}
    for point in sorted(points, key=lambda each: each.celsius):
        near = [key for key in groups if abs(key - point.celsius) <= _SAME_CELSIUS]
        groups.setdefault(near[-1] if near else point.celsius, []).append(point)
    return groups


def _inside(law: ForceLaw, points: Sequence[GapPoint]) -> list[GapPoint]:
    found = [point for point in points if law.gap_low <= point.gap <= law.gap_high]
    if len(found) < 4:
        raise LawRefusedError(
            f'the force law of the base holds for {law.gap_low * 1e6:.0f} .. {law.gap_high * 1e6:.0f} um, '
            f'where only {len(found)} recordings are, 4 are needed; calibrate the actuator first and give it '
            'as --base'
        )
    return found


def _intervals(intervals: Sequence[tuple[float, float]], factor: float) -> str:
    if not intervals:
        return 'no'
    return ', '.join(f'{low * factor:.2f} .. {high * factor:.2f}' for low, high in intervals)
