"""Gap curves from ripple recordings at one or more coil temperatures, with figures and the specimen."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.coil.curves import CurveFit, GapCalibration, calibrate_gap_curves
from engine_mount.identification.coil.points import GapPoint, RippleRecording, measured_point
from engine_mount.identification.coil.temperature import (
    gap_errors,
    measured_compensation,
    stated_compensation,
)
from engine_mount.identification.coil.unique_region import UniqueRegion, interval_text, unique_region
from engine_mount.identification.specimen import described_files, rounded, with_part
from engine_mount.recordings.screen import Screen, Table
from mount_models.coil.correction import CONDUCTIVITY_COEFFICIENT, TemperatureCompensation
from mount_models.quantity import LawRefusedError, OutsideLawError
from mount_models.specimen import Specimen

_SAME_CELSIUS = 5.0  # K, chosen
_SOURCES = {'fitted': 'measured, used by the fit', 'held out': 'measured, held out'}


@dataclass(frozen=True)
class InductanceCalibration:
    """Curves, their compensation and its origin, what is unique, and what temperature leaves.

    `base` gives all other values, and where the gap is measured: `rest_current`, `crossing_inductance`.
    """

    base: Specimen
    files: Sequence[Path]
    calibration: GapCalibration
    compensation: TemperatureCompensation | None
    compensated_by: str
    region: UniqueRegion
    temperature_errors: list[dict[str, Any]]
    warnings: list[str]

    @property
    def tables(self) -> list[GapPoint]:
        """The points that were interpolated from tables of few points."""
        return [point for point in self.calibration.points if point.table is not None]

    @property
    def table_currents(self) -> tuple[float, float]:
        """The range of currents (A) that all tables of few points have."""
        low, high = zip(*(point.table for point in self.tables if point.table), strict=True)
        return max(low), min(high)

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON; SI units, temperatures in degC."""
        fits, compensation = self.calibration, self.compensation
        return {
            'curves': {
                name: {
                    **fit.polynomial._asdict(),
                    'coefficient_std': np.sqrt(fit.covariance.diagonal()).tolist(),
                    'degree': fit.degree,
                    'gap_rms_m': fit.gap_rms,
                    'largest_gap_std_m': fit.largest_gap_std,
                }
                for name, fit in (
                    ('inductance_of_gap', fits.inductance),
                    ('crossing_current_of_gap', fits.crossing),
                )
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
                for point in fits.points
            ],
            'unique': {
                'falling_a': self.region.falling,
                'rising_a': self.region.rising,
                'inductance_h': self.region.levels,
            },
            'temperature': {
                'compensated_by': self.compensated_by,
                'coefficient_per_k': compensation and compensation.conductivity_coefficient,
                'gap_error_um': self.temperature_errors,
            },
            'warnings': self.warnings,
        }

    def report(self, screen: Screen) -> None:
        """Show the residuals by gap, what temperature leaves, and where the gap is unique."""
        points, fits, region = self.calibration.points, self.calibration, self.region
        rows: list[tuple[str, ...]] = [
            (
                f'{point.gap * 1e6:.1f}',
                f'{point.inductance * 1e3:.3f}',
                f'{rest * 1e6:+.2f}',
                f'{point.crossing_current:.4f}',
                f'{contact * 1e6:+.2f}',
            )
            for point, rest, contact in zip(
                points, fits.inductance.gap_errors, fits.crossing.gap_errors, strict=True
            )
        ]
        heads: tuple[str, ...] = ('air gap (µm)', 'L at rest (mH)', 'error', 'crossing (A)', 'error')
        screen.table(Table('gap curves: error of the curve as a gap (µm)', 'rrrrr', rows, heads))
        names = ('rest_uncompensated_um', 'rest_um', 'contact_uncompensated_um', 'contact_um')
        rows = [
            (f'{row["celsius"]:.0f}', *(f'{row[name]:.1f}' for name in names), _SOURCES[row['source']])
            for row in self.temperature_errors
        ]
        heads = ('degC', 'at rest', 'compensated', 'at contact', 'compensated', 'from')
        screen.table(Table('largest gap error by coil temperature (µm)', 'rrrrrl', rows, heads))
        curve = fits.inductance.polynomial
        screen.say(
            f'valid within {curve.low * 1e6:.1f} .. {curve.high * 1e6:.1f} um; largest standard deviation '
            f'of a gap by the curve alone {fits.inductance.largest_gap_std * 1e6:.2f} um at rest, '
            f'{fits.crossing.largest_gap_std * 1e6:.2f} um at contact'
        )
        screen.say(
            f'the inductance determines the gap at {interval_text(region.falling)} A (falls with the gap) '
            f'and {interval_text(region.rising)} A (rises), and by its current at '
            f'{interval_text(region.levels, 1e3)} mH; elsewhere it is ambiguous or unknown'
        )
        screen.say(f'temperature compensation: {self.compensated_by}')
        if self.tables:
            low, high = self.table_currents
            rest, contact = (
                1e3 * max(getattr(point, name) for point in self.tables)
                for name in ('inductance_std', 'crossing_std')
            )
            screen.say(
                f'{len(self.tables)} of {len(points)} recordings are tables of few points, measured within '
                f'{low:.2f} .. {high:.2f} A: in between by interpolation, good to {rest:.2g} mH at rest and '
                f'to {contact:.2g} mA of the crossing current, by how well the points predict each other'
            )
        for warning in self.warnings:
            screen.note(warning, 'warning')

    def specimen(self, name: str = '') -> Specimen:
        """Return the base under `name` with the curves and their compensation; raises `SpecimenError`."""
        fits, curve = self.calibration, self.calibration.inductance.polynomial
        valid: dict[str, Any] = {'gap': [curve.low, curve.high]}
        if self.tables:
            valid['interpolated_within_current'] = rounded(self.table_currents)
        origin = {
            'valid': valid,
            'celsius': rounded(float(np.mean([point.celsius for point in fits.points]))),
            'temperature_compensation': self.compensated_by,
            'inductance_of_gap': _fit_entry(fits.inductance),
            'crossing_current_of_gap': _fit_entry(fits.crossing),
        }
        recordings = described_files(self.files)
        return with_part(
            self.base, name, 'gap_curves', recordings, origin, gap_curves=fits.curves,
            temperature=self.compensation,
        )  # fmt: skip

    def draw(self, file: Path) -> None:
        """Write the picture of map, curves and what temperature leaves to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_gap_curves

        draw_gap_curves(self, file)


def calibrate_inductance(
    recordings: Sequence[RippleRecording],
    base: Specimen,
    files: Sequence[Path],
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
    held_out: Sequence[float] = (),
) -> InductanceCalibration:
    """Return the calibration by the core's `coefficient` (1/K); raises `LawRefusedError`.

    Recordings at temperatures `held_out` (degC) only judge it.
    """
    points = [measured_point(each, base.rest_current, base.crossing_inductance) for each in recordings]
    unseen = [point for point in points if any(_alike(point.celsius, celsius) for celsius in held_out)]
    fitted = [point for point in points if point not in unseen]
    groups: dict[float, list[GapPoint]] = {}
    for point in sorted(fitted, key=lambda each: each.celsius):
        near = [key for key in groups if _alike(key, point.celsius)]
        groups.setdefault(near[-1] if near else point.celsius, []).append(point)
    if not groups:
        raise LawRefusedError(
            f'all {len(points)} recordings are held out; leave those out of --held-out-temperature that the '
            'curves shall be fitted to'
        )
    own = max(groups, key=lambda celsius: (len(groups[celsius]), -abs(celsius - 20.0)))
    here = groups.pop(own)
    region = unique_region([each for each, point in zip(recordings, points, strict=True) if point in here])
    warnings = region.warnings(base.rest_current, base.crossing_inductance)
    try:
        calibration = calibrate_gap_curves(here)
    except LawRefusedError as error:
        raise LawRefusedError('; '.join([str(error), *warnings])) from error
    curves, celsius = calibration.curves, float(np.mean([point.celsius for point in here]))
    compensation: TemperatureCompensation | None = None
    if groups:
        other = groups[max(groups, key=lambda key: (len(groups[key]), abs(key - own)))]
        compensation = measured_compensation(curves, celsius, other, coefficient)
        how = (
            f'measured at {celsius:.0f} and {compensation.reference_celsius:.0f} degC, in between by the '
            f'coefficient of the core, {coefficient:g} 1/K'
        )
    else:
        try:
            compensation = stated_compensation(curves, celsius, calibration.points, base, coefficient)
            how = (
                f'stated: coefficient of the core {coefficient:g} 1/K, share of the core from the force law; '
                'recordings at a second temperature would measure it'
            )
        except (LawRefusedError, OutsideLawError) as error:
            how = 'none'
            warnings.append(f'coil temperature is not compensated: {error}')
    errors = gap_errors(curves, compensation, fitted, 'fitted')
    errors += gap_errors(curves, compensation, unseen, 'held out')
    return InductanceCalibration(base, files, calibration, compensation, how, region, errors, warnings)


def _alike(one: float, other: float) -> bool:
    return abs(one - other) <= _SAME_CELSIUS


def _fit_entry(fit: CurveFit) -> dict[str, Any]:
    return {
        'degree': fit.degree,
        'gap_rms': rounded(fit.gap_rms),
        'largest_gap_std': rounded(fit.largest_gap_std),
        'gap_errors': rounded(fit.gap_errors),
        'covariance': rounded(fit.covariance),
    }
