"""Sizes and durations as people write them, and the options of the recorder that are made of them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.automatic_marks import mark_kinds
from mount_recorder.bag_writer import SplitRule, checked_rule
from mount_recorder.parameters import RecorderParameters, split_of

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


def recorder_options(split: Sequence[str], snapshot: str, snapshot_after: str = '') -> dict[str, Any]:
    """Return {parameter: value} of the recorder of texts such as `500MB`, `60s`; raises `ParameterError`."""
    options: dict[str, Any] = {}
    if split:
        rule = split_rule(split)
        options.update(split_size=rule.size, split_duration=rule.duration * 1e-9)
    for name, text in (('snapshot', snapshot), ('snapshot_after', snapshot_after)):
        if text:
            options[name] = duration_in_nanoseconds(text) * 1e-9
    return options


def checked_recorder(options: Mapping[str, Any]) -> RecorderParameters:
    """Return the recorder's parameters, or raise the `ValueError` with which it would refuse them."""
    parameters = with_flattened(RecorderParameters(), options)
    split_of(parameters)
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


def _unit(text: str) -> str:
    match = _AMOUNT.fullmatch(text)
    return match[2] if match else ''


def _amount(text: str, units: dict[str, int], wanted: str) -> int:
    match = _AMOUNT.fullmatch(text)
    if match is None or match[2] not in units:
        raise ParameterError(f'{text!r} is no {wanted}; units are {", ".join(units)}')
    return round(float(match[1]) * units[match[2]])
