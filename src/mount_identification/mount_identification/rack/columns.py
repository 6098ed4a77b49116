"""Columns of a rack's CSV file in SI units: the unit stands in the name, and the magnitude must fit it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mount_bags.signals.csv_file import read_csv
from mount_bags.signals.table import Table

FloatArray = NDArray[np.float64]


class RackRecordingError(ValueError):
    """A rack recording cannot be used; the text says why and the remedy."""


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured quantity: units with factor and offset to SI, and the range of its largest value."""

    name: str
    units: Mapping[str, tuple[float, float]]
    low: float
    high: float
    symbol: str


GAP = Channel('gap', {'um': (1e-6, 0), 'mm': (1e-3, 0), 'm': (1, 0)}, 20e-6, 5e-3, 'm')
CURRENT = Channel('current', {'a': (1, 0), 'ma': (1e-3, 0)}, 0.05, 20.0, 'A')
FORCE = Channel('force', {'n': (1, 0), 'kn': (1e3, 0)}, 2.0, 2e4, 'N')
INDUCTANCE = Channel('inductance', {'h': (1, 0), 'mh': (1e-3, 0)}, 1e-3, 1.0, 'H')
CURRENT_RATE = Channel('current_rate', {'a_per_s': (1, 0), 'a_per_ms': (1e3, 0)}, 10.0, 1e5, 'A/s')
FLUX_RATE = Channel('flux_rate', {'t_per_s': (1, 0), 't_per_ms': (1e3, 0)}, 5.0, 1e5, 'T/s')
TEMPERATURE = Channel(
    'coil_temperature', {'c': (1, 0), 'degc': (1, 0), 'k': (1, -273.15)}, -60.0, 250.0, 'degC'
)


def read_columns(
    file: Path, channels: Sequence[Channel], optional: Sequence[Channel], chosen: Mapping[str, str]
) -> dict[str, FloatArray]:
    """Return the channels of a CSV `file` in SI units (temperatures in degC), by name.

    A channel is the column `<name>_<unit>`, or the one `chosen` for it, by its header or as HEADER:UNIT.
    Raises `RackRecordingError` or `SignalError`.
    """
    table = read_csv(file)
    found = {}
    for channel in (*channels, *optional):
        column = _column(table, channel, chosen.get(channel.name, ''))
        if column is not None:
            found[channel] = column
        elif channel in channels:
            names = ' or '.join(f'{channel.name}_{unit}' for unit in channel.units)
            raise RackRecordingError(
                f'{file} has no column {names}; its columns are {", ".join(table.header)}: rename one, or '
                f'choose it with --column {channel.name}=HEADER:UNIT'
            )
    places = [place for place, _ in found.values()]
    rows = table.columns(*places)
    result = {}
    for (channel, (place, unit)), values in zip(found.items(), rows, strict=True):
        _check_finite(table, table.header[place], values)
        result[channel.name] = _in_si(table, channel, table.header[place], unit, values)
    return result


def check_alive(file: Path, name: str, unit: str, values: FloatArray, driven: FloatArray) -> None:
    """Raise `RackRecordingError` for a channel that is constant, or stuck while the `driven` one changes."""
    if np.ptp(values) == 0.0:
        raise RackRecordingError(
            f'{file}: {name} is constant ({values[0]:g} {unit} in all {values.size} rows); is its sensor '
            f'connected, and the right column chosen?'
        )
    same = (np.diff(values) == 0.0) & (np.diff(driven) != 0.0)
    ends = np.flatnonzero(np.concatenate([[True], ~same, [True]]))
    longest = int(np.diff(ends).max())
    if longest > _LONGEST_STUCK:
        start = int(ends[np.argmax(np.diff(ends))])
        raise RackRecordingError(
            f'{file}: {name} stayed at {values[start]:g} {unit} for {longest} rows from row {start + 1} on '
            f'while the current changed, more than {_LONGEST_STUCK}; the sensor is stuck: leave these rows '
            'out'
        )


_LONGEST_STUCK = 12  # rows, chosen: coarse converters repeat themselves for a few
_BRACKET = re.compile(r'[\[(]\s*([\w/]+)\s*[\])]\s*$')


def _column(table: Table, channel: Channel, chosen: str) -> tuple[int, str] | None:
    """Return place and unit of the channel's column; the unit is empty where the name tells none."""
    if chosen:
        header, colon, unit = chosen.rpartition(':')
        if not colon:
            header, unit = chosen, _unit_of(chosen, channel)
        if header not in table.header:
            raise RackRecordingError(
                f'column {header!r} is not in {table.path}; its columns are {", ".join(table.header)}'
            )
        if colon and unit.lower() not in channel.units:
            raise RackRecordingError(
                f'{unit!r} is no unit of {channel.name}; known are {", ".join(channel.units)}'
            )
        return table.header.index(header), unit.lower()
    for unit in channel.units:
        if f'{channel.name}_{unit}' in (name.lower() for name in table.header):
            return [name.lower() for name in table.header].index(f'{channel.name}_{unit}'), unit
    for place, name in enumerate(table.header):
        bare = _BRACKET.sub('', name).strip().lower()
        if bare == channel.name:
            return place, _unit_of(name, channel)
    return None


def _unit_of(header: str, channel: Channel) -> str:
    bracket = _BRACKET.search(header)
    if bracket and bracket[1].lower() in channel.units:
        return bracket[1].lower()
    suffixes = (unit for unit in channel.units if header.lower().endswith(f'_{unit}'))
    return max(suffixes, key=len, default='')


def _check_finite(table: Table, header: str, values: FloatArray) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise RackRecordingError(
            f'{table.path}, line {table.lines[bad[0]]}: {header} is {values[bad[0]]} ({bad.size} such of '
            f'{values.size}); leave these lines out'
        )


def _in_si(table: Table, channel: Channel, header: str, unit: str, values: FloatArray) -> FloatArray:
    reach = f'{values.min():g} .. {values.max():g}'
    guess = _guess(channel, values)
    if not unit:
        told = f'they look like {guess}' if guess else f'they fit none of {", ".join(channel.units)}'
        raise RackRecordingError(
            f'{table.path}: column {header!r} names no unit; its values are {reach}, {told}: rename it to '
            f'{channel.name}_{guess or next(iter(channel.units))}, or choose --column '
            f'{channel.name}={header}:UNIT'
        )
    factor, offset = channel.units[unit]
    converted = values * factor + offset
    if not _plausible(channel, converted):
        low, high = channel.low, channel.high
        remedy = (
            f'are they in {guess}? Rename the column to {channel.name}_{guess}'
            if guess
            else 'check the sensor'
        )
        raise RackRecordingError(
            f'{table.path}: {header} ({reach} {unit}) must reach a largest value within {low:g} .. {high:g} '
            f'{channel.symbol}; {remedy}'
        )
    return np.asarray(converted)


def _plausible(channel: Channel, values: FloatArray) -> bool:
    largest = float(np.max(values if channel is TEMPERATURE else np.abs(values)))
    return channel.low <= largest <= channel.high


def _guess(channel: Channel, values: FloatArray) -> str:
    fitting = (
        unit
        for unit, (factor, offset) in channel.units.items()
        if _plausible(channel, values * factor + offset)
    )
    return next(fitting, '')
