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

from mount_models.plain_yaml import excerpt
from mount_models.quantity import ParameterError


def check_provenance(provenance: Mapping[str, Any]) -> None:
    """Raise `ParameterError` at the first entry that cannot be."""
    _check_plain(provenance, 'provenance')
    parts = provenance.get('parts', {})
    _require(isinstance(parts, Mapping), 'provenance.parts', 'be a mapping of parts to their origin', parts)
    for name, part in parts.items():
        where, specimen = f'provenance.parts.{name}', isinstance(part, Mapping) and part.get('specimen')
        named = isinstance(specimen, str) and bool(specimen)
        _require(named, where, 'be a mapping with the name of a specimen', part)
        _check_known(part, where)


def _check_plain(value: Any, where: str) -> None:
    if isinstance(value, Mapping):
        for name, part in value.items():
            _require(isinstance(name, str) and bool(name), where, 'have texts as names', name)
            _check_plain(part, f'{where}.{name}')
    elif isinstance(value, (list, tuple)):
        for place, part in enumerate(value):
            _check_plain(part, f'{where}[{place}]')
    elif isinstance(value, float):
        _require(math.isfinite(value), where, 'be a finite number', value)
    else:
        plain = value is None or isinstance(value, (str, int))
        _require(plain, where, 'be a text, a number, or a list or mapping of them', value)


def _check_known(part: Mapping[str, Any], where: str) -> None:
    for name, value in part.items():
        place = f'{where}.{name}'
        if name == 'date':
            _require(_is_date(value), place, "be a text such as '2026-05-04T10:00:00+00:00'", value)
        elif name == 'recordings':
            _require(isinstance(value, list) and bool(value), place, 'be a list of recordings', value)
            for k, each in enumerate(value):
                _require(
                    _is_file(each), f'{place}[{k}]', 'tell file and sha256 (64 hexadecimal digits)', each
                )
        elif name == 'valid':
            for each, limits in _named(value):
                rising = _are_numbers(limits) and len(limits) == 2 and limits[0] <= limits[1]
                _require(rising, place + each, 'be two numbers in rising order', limits)
        elif name == 'covariance':
            for each, matrix in _named(value):
                form = 'be a square matrix of numbers, none below 0 on its diagonal'
                _require(_is_covariance(matrix), place + each, form, matrix)
                alike = not each or len(matrix) == len(each.split(', '))
                _require(alike, place + each, 'have one row for each of its names', matrix)
        elif isinstance(value, Mapping):
            _check_known(value, place)


def _named(value: Any) -> list[tuple[str, Any]]:
    """Return one entry without a name, or several with theirs, as they follow the name of all."""
    if isinstance(value, Mapping) and value:
        return [(f'.{name}', each) for name, each in value.items()]
    return [('', value)]


def _is_date(value: Any) -> bool:
    try:
        return bool(datetime.datetime.fromisoformat(value))
    except (TypeError, ValueError):
        return False


def _is_file(value: Any) -> bool:
    known = isinstance(value, Mapping) and isinstance(value.get('file'), str) and value['file']
    return bool(known and _SHA256.fullmatch(str(value.get('sha256'))))


def _is_covariance(value: Any) -> bool:
    if not isinstance(value, list) or not value or not all(_are_numbers(row) for row in value):
        return False
    return all(len(row) == len(value) and row[k] >= 0.0 for k, row in enumerate(value))


_SHA256 = re.compile('[0-9a-f]{64}')


def _are_numbers(values: Any) -> bool:
    return isinstance(values, list) and all(type(value) in (int, float) for value in values)


def _require(held: bool, where: str, words: str, value: Any) -> None:
    if not held:
        raise ParameterError(
            f'{where} must {words}; instead received {excerpt(value)}: correct it or calibrate again'
        )
