"""Columns of a rack's file in SI units: the unit stands in the name, and the magnitude must fit it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.identification.rack.measured_table import MeasuredTable
from engine_mount.identification.rack.unit_words import unit_word
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.signal import SignalError
from engine_mount.signals.units.mapping import ColumnChoice
from engine_mount.signals.units.unit import ZERO_CELSIUS

FloatArray = NDArray[np.float64]


class RackRecordingError(ValueError):
    """A rack recording cannot be used; the text says why and the remedy."""


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured quantity: its dimension, and the range of its largest value (SI, temperatures in degC).

    `usual` are the units that racks write, the likeliest first: what a refusal names, and guesses by.
    """

    name: str
    dimension: str
    usual: tuple[str, ...]
    low: float
    high: float
    symbol: str


GAP = Channel('gap', 'length', ('um', 'mm', 'm'), 20e-6, 5e-3, 'm')
CURRENT = Channel('current', 'current', ('a', 'ma'), 0.05, 20.0, 'A')
FORCE = Channel('force', 'force', ('n', 'kn'), 2.0, 2e4, 'N')
INDUCTANCE = Channel('inductance', 'inductance', ('h', 'mh'), 1e-3, 1.0, 'H')
CURRENT_RATE = Channel('current_rate', 'current/time', ('a_per_s', 'a_per_ms'), 10.0, 1e5, 'A/s')
FLUX_RATE = Channel('flux_rate', 'flux density/time', ('t_per_s', 't_per_ms'), 5.0, 1e5, 'T/s')
TEMPERATURE = Channel('coil_temperature', 'temperature', ('c', 'degc', 'k'), -60.0, 250.0, 'degC')


def read_columns(
    file: Path,
    channels: Sequence[Channel],
    optional: Sequence[Channel],
    chosen: Mapping[str, ColumnChoice],
    stated: Stated | None = None,
) -> dict[str, FloatArray]:
    """Return the channels of a `file` of any format in SI units (temperatures in degC), by name.

    A channel is the column `<name>_<unit>` or `<name> [<unit>]`, or the one `chosen` for it. Raises
    `RackRecordingError` or `SignalError`.
    """
    table = MeasuredTable(file, stated)
    found = {}
    for channel in (*channels, *optional):
        column = _column(table, channel, chosen.get(channel.name))
        if column is not None:
            found[channel] = column
        elif channel in channels:
            names = ' or '.join(f'{channel.name}_{unit}' for unit in channel.usual)
            raise RackRecordingError(
                f'{file} has no column {names}; its columns are {", ".join(table.header)}{table.told}: '
                f'rename one, or choose it with --column {channel.name}=HEADER:UNIT'
            )
    places = [place for place, _ in found.values()]
    rows = table.columns(*places)
    result = {}
    for (channel, (place, unit)), values in zip(found.items(), rows, strict=True):
        _check_finite(table, table.header[place], values)
        choice = chosen.get(channel.name)
        if choice is not None and choice.scale is not None:
            values = values * choice.scale
        result[channel.name] = _in_si(table, channel, table.header[place], unit, values)
        if choice is not None and choice.offset is not None:
            si = result[channel.name]
            result[channel.name] = si - (si.mean() if isinstance(choice.offset, str) else choice.offset)
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


def _column(table: MeasuredTable, channel: Channel, chosen: ColumnChoice | None) -> tuple[int, str] | None:
    """Return place and unit of the channel's column; the unit is empty where nothing tells one."""
    if chosen is not None:
        place, unit = _chosen_place(table, channel, chosen)
        return place, unit or _unit_of(table, place, channel)
    for place, name in enumerate(table.header):
        start, _, unit = name.lower().partition(f'{channel.name}_')
        if not start and unit and unit_word(unit, channel.dimension):
            return place, unit
    for place, name in enumerate(table.header):
        bare = _BRACKET.sub('', name).strip().lower()
        if channel.name in (bare, table.names[place].lower()):
            return place, _unit_of(table, place, channel)
    return None


def _chosen_place(table: MeasuredTable, channel: Channel, chosen: ColumnChoice) -> tuple[int, str]:
    """Return place and unit of the column that is `chosen`; raises `RackRecordingError`."""
    header, unit = chosen.column, chosen.unit
    if not unit and header not in table.header and ':' in header:
        header, _, unit = header.rpartition(':')
    try:
        place = table.place(header)
    except SignalError as error:
        raise RackRecordingError(str(error)) from None
    if unit and unit_word(unit, channel.dimension) is None:
        raise RackRecordingError(
            f'{unit!r} is no unit of {channel.name}; known are {", ".join(channel.usual)} and others of '
            f'{channel.dimension}'
        )
    return place, unit


def _unit_of(table: MeasuredTable, place: int, channel: Channel) -> str:
    """Return the unit that a title tells, '' where it tells none of the channel's."""
    header = table.header[place]
    bracket = _BRACKET.search(header)
    suffixes = [unit for unit in channel.usual if header.lower().endswith(f'_{unit}')]
    for unit in (table.units[place], bracket[1] if bracket else '', max(suffixes, key=len, default='')):
        if unit and unit_word(unit, channel.dimension):
            return unit
    return ''


def _check_finite(table: MeasuredTable, header: str, values: FloatArray) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise RackRecordingError(
            f'{table.path}, row {bad[0] + 1}: {header} is {values[bad[0]]} ({bad.size} such of '
            f'{values.size}); leave these rows out'
        )


def _in_si(table: MeasuredTable, channel: Channel, header: str, unit: str, values: FloatArray) -> FloatArray:
    reach = f'{values.min():g} .. {values.max():g}'
    guess = _guess(channel, values)
    if not unit:
        told = f'they look like {guess}' if guess else f'they fit none of {", ".join(channel.usual)}'
        raise RackRecordingError(
            f'{table.path}: column {header!r} names no unit; its values are {reach}, {told}: rename it to '
            f'{channel.name}_{guess or channel.usual[0]}, or choose --column '
            f'{channel.name}={header}:UNIT'
        )
    converted = _converted(channel, unit, values)
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
    fitting = (unit for unit in channel.usual if _plausible(channel, _converted(channel, unit, values)))
    return next(fitting, '')


def _converted(channel: Channel, unit: str, values: FloatArray) -> FloatArray:
    """Return values in SI, temperatures in degC."""
    word = unit_word(unit, channel.dimension)
    assert word is not None
    # two zeros that are alike cancel before they are added: 20 degC stay 20 to the bit
    zero = word.zero - (ZERO_CELSIUS if channel is TEMPERATURE else 0.0)
    return np.asarray(values * word.factor + zero)
