"""Writes a specimen as the file that the nodes load."""

import os
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import yaml

from mount_models.specimen import SCHEMA_VERSION, Specimen, checked_specimen

_READABLE = 0o644


def save_specimen(specimen: Specimen, path: str | Path) -> None:
    """Write the checked `specimen` to `path` as YAML without loss of digits, whole or not at all."""
    text = yaml.safe_dump(
        specimen_to_mapping(checked_specimen(specimen)), sort_keys=False, default_flow_style=None, width=110
    )
    target = Path(path)
    heading = '# Specimen of the engine mount. SI units; the coefficients of force_law: see Table 1.\n'
    with tempfile.NamedTemporaryFile(
        'w', encoding='utf-8', dir=target.parent, prefix=f'.{target.name}.', delete=False
    ) as file:
        try:
            file.write(heading + text)
            file.flush()
            os.fsync(file.fileno())
            os.chmod(file.name, _READABLE)
            os.replace(file.name, target)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise


def specimen_to_mapping(specimen: Specimen) -> dict[str, Any]:
    """Return the specimen as plain dictionaries, lists, texts and numbers."""
    content = {entry.name: _plain(getattr(specimen, entry.name)) for entry in fields(specimen)}
    return {'schema_version': SCHEMA_VERSION, **content}


def _plain(value: Any) -> Any:
    if hasattr(value, '_asdict'):
        return {name: _plain(part) for name, part in value._asdict().items()}
    if isinstance(value, Mapping):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value
