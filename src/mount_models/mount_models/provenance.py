"""Where a specimen comes from: free in its entries, but nothing in it may be nonsense.

Known entries have a form: `parts` with the `specimen` of each, `recordings` with their hashes, `valid`
ranges, square `covariance` (one, or several by the names of what varies together), `date`. All others hold
texts, finite numbers, and lists and mappings of them.
"""

import datetime
import math
import re
from collections.abc import Mapping
from typing import Any


class ProvenanceError(ValueError):
    """A provenance holds what cannot be; the text says where."""


def check_provenance(provenance: Mapping[str, Any]) -> None:
    """Raise `ProvenanceError` at the first entry that cannot be."""
    _check_plain(provenance, 'provenance')
    parts = provenance.get('parts', {})
    if not isinstance(parts, Mapping):
        raise ProvenanceError(
            f'provenance.parts must be a mapping of parts to their origin; instead received {_told(parts)}'
        )
    for name, part in parts.items():
        where = f'provenance.parts.{name}'
        if not (isinstance(part, Mapping) and isinstance(part.get('specimen'), str) and part['specimen']):
            raise ProvenanceError(
                f'{where} must be a mapping with the name of a specimen; instead received {_told(part)}'
            )
        _check_known(part, where)


def _check_plain(value: Any, where: str) -> None:
    if isinstance(value, Mapping):
        for name, part in value.items():
            if not isinstance(name, str) or not name:
                raise ProvenanceError(f'{where} must have texts as names; instead received {_told(name)}')
            _check_plain(part, f'{where}.{name}')
    elif isinstance(value, (list, tuple)):
        for place, part in enumerate(value):
            _check_plain(part, f'{where}[{place}]')
    elif isinstance(value, float) and not math.isfinite(value):
        raise ProvenanceError(f'{where} must be a finite number; instead received {_told(value)}')
    elif value is not None and not isinstance(value, (str, int, float)):
        raise ProvenanceError(
            f'{where} must be a text, a number, or a list or mapping of them; instead received {_told(value)}'
        )


def _check_known(part: Mapping[str, Any], where: str) -> None:
    for name, value in part.items():
        if name in _CHECKS:
            _CHECKS[name](value, f'{where}.{name}')
        elif isinstance(value, Mapping):
            _check_known(value, f'{where}.{name}')


def _check_date(value: Any, where: str) -> None:
    try:
        datetime.datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise ProvenanceError(
            f"{where} must be a text such as '2026-05-04T10:00:00+00:00'; instead received {_told(value)}"
        ) from None


def _check_recordings(value: Any, where: str) -> None:
    if not isinstance(value, list) or not value:
        raise ProvenanceError(f'{where} must be a list of recordings; instead received {_told(value)}')
    for place, entry in enumerate(value):
        each = entry if isinstance(entry, Mapping) else {}
        file, sha256 = each.get('file'), each.get('sha256')
        if not (isinstance(file, str) and file and isinstance(sha256, str) and _SHA256.fullmatch(sha256)):
            raise ProvenanceError(
                f'{where}[{place}] must tell file and sha256 (64 hexadecimal digits); instead received '
                f'{_told(entry)}'
            )


def _check_valid(value: Any, where: str) -> None:
    ranges = value if isinstance(value, Mapping) else {'': value}
    for name, limits in ranges.items():
        if not (_are_numbers(limits) and len(limits) == 2 and limits[0] <= limits[1]):
            raise ProvenanceError(
                f'{where}{name and "."}{name} must be two numbers in rising order; instead received '
                f'{_told(limits)}'
            )


def _check_covariance(value: Any, where: str) -> None:
    """Check one matrix, or several by the names of what varies together: {'a, b': matrix}."""
    if isinstance(value, Mapping) and value:
        for names, matrix in value.items():
            _check_covariance(matrix, f'{where}.{names}')
            if len(matrix) != len(names.split(', ')):
                raise ProvenanceError(
                    f'{where}.{names} must have one row for each of its names; it has {len(matrix)}'
                )
        return
    rows = value if isinstance(value, list) else []
    square = bool(rows) and all(_are_numbers(row) and len(row) == len(rows) for row in rows)
    if not square or not all(rows[k][k] >= 0.0 for k in range(len(rows))):
        raise ProvenanceError(
            f'{where} must be a square matrix of numbers, none below 0 on its diagonal; instead received '
            f'{_told(value)}'
        )


_SHA256 = re.compile('[0-9a-f]{64}')
_CHECKS = {
    'date': _check_date,
    'recordings': _check_recordings,
    'valid': _check_valid,
    'covariance': _check_covariance,
}


def _are_numbers(values: Any) -> bool:
    return isinstance(values, list) and all(
        isinstance(value, (int, float)) and not isinstance(value, bool) for value in values
    )


def _told(value: Any) -> str:
    return repr(value) if len(repr(value)) < 60 else type(value).__name__
