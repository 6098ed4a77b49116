"""The specimen after a calibration: new values, the rest from its base, and where each part comes from."""

import datetime
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.actuator.fit import ForceLawFit
from engine_mount.identification.coil.curve_fit import CurveFit
from engine_mount.identification.coil.gap_calibration import GapCalibration
from engine_mount.identification.friction.found import Identification, chosen_fit
from engine_mount.identification.friction.recording import IdentificationError
from engine_mount.identification.rack.columns import RackRecordingError
from engine_mount.identification.rack.given import described
from mount_models.coil.temperature import TemperatureCompensation
from mount_models.specimen import Specimen, checked_specimen


def check_targets(*files: Path | None) -> None:
    """Raise `RackRecordingError` unless every file that is to be written has a folder to be in."""
    for file in files:
        if file is not None and (file.is_dir() or not file.absolute().parent.is_dir()):
            raise RackRecordingError(f'{file} must be a file in an existing folder; make {file.parent} first')


def with_force_law(base: Specimen, name: str, fit: ForceLawFit, files: Sequence[Path]) -> Specimen:
    """Return `base` under `name` with the fitted law; raises `SpecimenError`."""
    law = fit.law
    entry = {
        **_origin(files),
        'points': fit.points,
        'valid': {
            'gap': [law.gap_low, law.gap_high],
            'current': [0.0, law.current_high],
            **({'measured_current': [_short(fit.lowest_current), law.current_high]} if fit.continued else {}),
        },
        'residuals': {
            'relative_rms': _short(fit.relative_rms),
            'relative_worst': _short(fit.worst),
            'rms': _short(fit.rms_error),
            'largest': _short(fit.largest_error),
            'gaps': [float(f'{gap:.6g}') for gap in fit.gaps],
            'rms_by_gap': [_short(value) for value in fit.gap_rms],
        },
        'covariance': _matrix(fit.covariance),
    }
    return checked_specimen(
        replace(
            base,
            name=name or base.name,
            force_law=law,
            current_limit=min(base.current_limit, law.current_high),
            provenance=_provenance(base, name, 'force_law', entry),
        )
    )


def with_gap_curves(
    base: Specimen,
    name: str,
    calibration: GapCalibration,
    compensation: TemperatureCompensation | None,
    how: str,
    turns_area: float,
    files: Sequence[Path],
) -> Specimen:
    """Return `base` under `name` with the fitted curves and their compensation; raises `SpecimenError`."""
    curve = calibration.curves.inductance_of_gap
    entry = {
        **_origin(files),
        'valid': {'gap': [curve.low, curve.high], **_currents_of_tables(calibration)},
        'celsius': _short(float(np.mean([point.celsius for point in calibration.points]))),
        'temperature_compensation': how,
        'inductance_of_gap': _fit_entry(calibration.inductance),
        'crossing_current_of_gap': _fit_entry(calibration.crossing),
    }
    return checked_specimen(
        replace(
            base,
            name=name or base.name,
            gap_curves=calibration.curves,
            turns_area=turns_area,
            temperature=compensation,
            provenance=_provenance(base, name, 'gap_curves', entry),
        )
    )


def with_friction(base: Specimen, name: str, found: Identification) -> Specimen:
    """Return `base` under `name` with the identified contact and coefficients; raises `SpecimenError`.

    Raises `IdentificationError` where the recordings did not give both, or one of them tells no coefficient.
    """
    from engine_mount.identification.friction.steps.ramp_hold import mean_covariance

    fit = chosen_fit(found)
    if found.cases:
        raise IdentificationError(
            'no coefficient of friction is written: ' + '; '.join(case.sentence for case in found.cases)
        )
    assert found.contact is not None  # or there were no lines, and no fit
    speeds = [abs(line.velocity) for line in found.lines]
    covariance: dict[str, Any] = {', '.join(part.names): _matrix(part.covariance) for part in fit.covariances}
    if found.ramps:
        covariance[', '.join(found.contact._fields)] = _matrix(
            mean_covariance([each for _, each in found.ramps])
        )
    entry = {
        **_made_with(),
        'recordings': [{'file': file, **told} for file, told in found.recordings.items()],
        'valid': {
            'normal_force': [fit.coefficients.lowest_normal_force, fit.coefficients.highest_normal_force],
            'speed': [_short(min(speeds)), _short(max(speeds))],
        },
        'form_of_b': fit.variant,
        'contact': 'identified' if found.ramps else 'that of the base',
        'residuals': {
            'a_rms': _short(fit.a_rms),
            'b_rms_per_mm': _short(fit.b_rms_mm),
            'held_out': {each.name: _short(each.full_error) for _, each in found.validations},
        },
        'covariance': covariance,
    }
    return checked_specimen(
        replace(
            base,
            name=name or base.name,
            friction={**fit.coefficients._asdict(), **found.contact._asdict()},
            provenance=_provenance(base, name, 'friction', entry, 'engine-mount identify'),
        )
    )


def _currents_of_tables(calibration: GapCalibration) -> dict[str, Any]:
    """Return the range of currents of tables of few points, where such were interpolated; else nothing."""
    tables = [point.table for point in calibration.points if point.table is not None]
    if not tables:
        return {}
    low, high = max(low for low, _ in tables), min(high for _, high in tables)
    return {'interpolated_within_current': [_short(low), _short(high)]}


def foreign_parts(specimen: Specimen) -> list[str]:
    """Return the parts that were calibrated on another specimen or not at all, for a warning."""
    parts = specimen.provenance.get('parts', {})
    return [
        part
        for part in ('force_law', 'gap_curves', 'friction')
        if parts.get(part, {}).get('specimen', specimen.name) != specimen.name
    ]


def _provenance(
    base: Specimen, name: str, part: str, entry: dict[str, Any], written_by: str = 'engine-mount calibrate'
) -> dict[str, Any]:
    """Return the origin of each part; what was not calibrated now keeps that of `base`."""
    before = base.provenance.get('parts')
    if not isinstance(before, dict):
        other = {'specimen': base.name, 'from': base.provenance.get('written_by', 'unknown')}
        before = {'force_law': other, 'gap_curves': dict(other)}
        if base.friction:
            before['friction'] = dict(other)
    return {
        'written_by': written_by,
        'parts': {**before, part: {'specimen': name or base.name, **entry}},
    }


def _origin(files: Sequence[Path]) -> dict[str, Any]:
    return {**_made_with(), 'recordings': described(files)}


def _made_with() -> dict[str, Any]:
    from mount_recorder.versions import versions

    known = versions()
    return {
        'date': datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds'),
        'versions': {name: known[name] for name in ('mount_bringup', 'numpy', 'scipy')},
    }


def _fit_entry(fit: CurveFit) -> dict[str, Any]:
    return {
        'degree': fit.degree,
        'gap_rms': _short(fit.gap_rms),
        'largest_gap_std': _short(fit.largest_gap_std),
        'gap_errors': [_short(value) for value in fit.gap_errors],
        'covariance': _matrix(fit.covariance),
    }


def _matrix(values: np.ndarray) -> list[list[float | None]]:
    return [[_short(value) for value in row] for row in values]


def _short(value: float) -> float | None:
    """Return `value` with the four digits that say all there is to say; None where it is unknown."""
    return float(f'{value:.4g}') if math.isfinite(value) else None
