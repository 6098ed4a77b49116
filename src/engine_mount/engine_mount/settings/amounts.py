"""Sizes and durations as people write them."""

import re
from collections.abc import Iterable

from mount_models.quantity import ParameterError
from mount_recorder.bag_writer import SplitRule, checked_rule

_SIZES = {'B': 1, 'kB': 10**3, 'MB': 10**6, 'GB': 10**9, 'KiB': 1 << 10, 'MiB': 1 << 20, 'GiB': 1 << 30}
_DURATIONS = {'ms': 10**6, 's': 10**9, 'min': 60 * 10**9, 'h': 3600 * 10**9}
_AMOUNT = re.compile(r'\s*(\d+(?:\.\d+)?)\s*([A-Za-z]+)\s*')


def split_rule(texts: Iterable[str]) -> SplitRule:
    """Return the rule of texts such as `500MB` or `60s`, one of each kind at most; or `ParameterError`."""
    size = duration = 0
    for text in texts:
        unit = _unit(text)
        if unit in _SIZES and not size:
            size = size_in_bytes(text)
        elif unit in _DURATIONS and not duration:
            duration = duration_in_nanoseconds(text)
        elif unit in _SIZES or unit in _DURATIONS:
            raise ParameterError(f'{text!r} is a second limit of its kind; give one size and one duration')
        else:
            raise ParameterError(f'{text!r} is no size and no duration; write 500MB, 1GiB, 60s or 10min')
    return checked_rule(SplitRule(size, duration))


def size_in_bytes(text: str) -> int:
    """Return the bytes of a text such as `500MB` or `2GiB`; raises `ParameterError`."""
    return _amount(text, _SIZES, 'size such as 500MB')


def duration_in_nanoseconds(text: str) -> int:
    """Return the ns of a text such as `30s` or `1.5min`; raises `ParameterError`."""
    return _amount(text, _DURATIONS, 'duration such as 30s')


def _unit(text: str) -> str:
    match = _AMOUNT.fullmatch(text)
    return match[2] if match else ''


def _amount(text: str, units: dict[str, int], wanted: str) -> int:
    match = _AMOUNT.fullmatch(text)
    if match is None or match[2] not in units:
        raise ParameterError(f'{text!r} is no {wanted}; units are {", ".join(units)}')
    return round(float(match[1]) * units[match[2]])
