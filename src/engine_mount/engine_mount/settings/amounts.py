"""Sizes and durations as people write them, and the options of the recorder that are made of them."""

import re
from collections.abc import Mapping
from typing import Any

from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.automatic_marks import mark_kinds
from mount_recorder.parameters import RecorderParameters, check_split

_SIZES = {'B': 1, 'kB': 10**3, 'MB': 10**6, 'GB': 10**9, 'KiB': 1 << 10, 'MiB': 1 << 20, 'GiB': 1 << 30}
_DURATIONS = {'ms': 10**6, 's': 10**9, 'min': 60 * 10**9, 'h': 3600 * 10**9}
_AMOUNT = re.compile(r'\s*(\d+(?:\.\d+)?)\s*([A-Za-z]+)\s*')


def recorder_options(split: str) -> dict[str, Any]:
    """Return {parameter: value} of the recorder of a size such as `500MB`; raises `ParameterError`."""
    return {'split_size': size_in_bytes(split)} if split else {}


def checked_recorder(options: Mapping[str, Any]) -> RecorderParameters:
    """Return the recorder's parameters, or raise the `ValueError` with which it would refuse them."""
    parameters = with_flattened(RecorderParameters(), options)
    check_split(parameters.split_size)
    mark_kinds(parameters.automatic_marks)
    if parameters.on_full not in ('stop', 'continue'):
        raise ParameterError(f'on_full must be stop or continue; instead received {parameters.on_full!r}')
    return parameters


def size_in_bytes(text: str) -> int:
    """Return the bytes of a text such as `500MB` or `2GiB`; raises `ParameterError`."""
    return _amount(text, _SIZES, 'size such as 500MB')


def duration_in_nanoseconds(text: str) -> int:
    """Return the ns of a text such as `30s` or `1.5min`; raises `ParameterError`."""
    return _amount(text, _DURATIONS, 'duration such as 30s')


def _amount(text: str, units: dict[str, int], wanted: str) -> int:
    match = _AMOUNT.fullmatch(text)
    if match is None or match[2] not in units:
        raise ParameterError(f'{text!r} is no {wanted}; units: {", ".join(units)}')
    return round(float(match[1]) * units[match[2]])
