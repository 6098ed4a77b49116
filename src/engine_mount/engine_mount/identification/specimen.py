"""The specimen after a calibration: new values, the rest from its base, the origin of each part; its file."""

import datetime
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import yaml

from engine_mount.recordings.recording import recording_hash
from mount_models.specimen import SCHEMA_VERSION, Specimen, checked_specimen
from mount_recorder.versions import versions

PARTS = {
    'force_law': 'calibrate actuator',
    'gap_curves': 'calibrate inductance',
    'friction': 'identify friction',
}
"""Parts of a specimen that are measured, and the command for each."""


def described_files(files: Sequence[Path]) -> list[dict[str, str]]:
    """Return name and SHA-256 of each recording; of a folder, that of its files one after the other."""
    return [{'file': file.name, 'sha256': recording_hash(file)} for file in files]


def with_part(
    base: Specimen, name: str, part: str, recordings: Sequence[Any], origin: dict[str, Any], **values: Any
) -> Specimen:
    """Return `base` under `name` with new `values`, and the `origin` of this `part` in its provenance.

    A part that was not measured now keeps the origin that it has in `base`. Raises `SpecimenError`.
    """
    name = name or base.name
    parts = base.provenance.get('parts')
    if not isinstance(parts, dict):
        measured = [each for each in PARTS if each != 'friction' or base.friction]
        written_by = base.provenance.get('written_by', 'unknown')
        parts = {each: {'specimen': base.name, 'from': written_by} for each in measured}
    known = versions()
    entry = {
        'specimen': name,
        'date': datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds'),
        'versions': {each: known[each] for each in ('mount_bringup', 'numpy', 'scipy')},
        'recordings': list(recordings),
        **origin,
    }
    command = PARTS[part].partition(' ')[0]
    provenance = {'written_by': f'engine-mount {command}', 'parts': {**parts, part: entry}}
    return checked_specimen(replace(base, name=name, provenance=provenance, **values))


def foreign_parts(specimen: Specimen) -> list[str]:
    """Return the parts that were measured on another specimen or not at all, for a warning."""
    parts = specimen.provenance.get('parts', {})
    return [part for part in PARTS if parts.get(part, {}).get('specimen', specimen.name) != specimen.name]


def rounded(value: Any) -> Any:
    """Return a number, or an array of numbers as lists, with four digits; None where it is unknown."""
    if hasattr(value, '__len__'):
        return [rounded(each) for each in value]
    return float(f'{value:.4g}') if math.isfinite(value) else None


def save_specimen(specimen: Specimen, path: str | Path) -> None:
    """Write the checked `specimen` to `path` as YAML without loss of digits, whole or not at all."""
    text = yaml.safe_dump(
        specimen_to_mapping(checked_specimen(specimen)), sort_keys=False, default_flow_style=None, width=110
    )
    heading = '# Specimen of the engine mount. SI units; the coefficients of force_law: see Table 1.\n'
    target = Path(path)
    beside = target.with_name(f'.{target.name}.{os.getpid()}')
    try:
        with beside.open('w', encoding='utf-8') as file:
            file.write(heading + text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, target)
    finally:
        beside.unlink(missing_ok=True)


def specimen_to_mapping(specimen: Specimen) -> dict[str, Any]:
    """Return the specimen as plain dictionaries, lists, texts and numbers."""
    content = {entry.name: _plain(getattr(specimen, entry.name)) for entry in fields(specimen)}
    return {'schema_version': SCHEMA_VERSION, **content}


def _plain(value: Any) -> Any:
    if hasattr(value, '_asdict'):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value
