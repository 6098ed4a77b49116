"""Where a specimen comes from: free in its entries, but nothing in it may be nonsense.

`parts` names the `specimen` of each part; all entries hold texts, finite numbers, and lists and mappings of
them.
"""

import math
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
        specimen = isinstance(part, Mapping) and part.get('specimen')
        named = isinstance(specimen, str) and bool(specimen)
        _require(named, f'provenance.parts.{name}', 'be a mapping with the name of a specimen', part)


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


def _require(held: bool, where: str, words: str, value: Any) -> None:
    if not held:
        raise ParameterError(
            f'{where} must {words}; instead received {excerpt(value)}: correct it or calibrate again'
        )
