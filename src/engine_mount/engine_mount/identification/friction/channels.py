"""Which column is which quantity of a friction recording, and its unit: by title, option or mapping."""

import re
from collections.abc import Mapping as Keys
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from engine_mount.identification.friction.recording import FloatArray, IdentificationError
from engine_mount.identification.rack.measured_table import MeasuredTable
from engine_mount.identification.rack.unit_words import unit_word
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.table import Table
from engine_mount.signals.units.column_unit import factor_beside_unit
from engine_mount.signals.units.columns import stated_with
from engine_mount.signals.units.mapping import ColumnChoice, Mapping, TimeChoice
from engine_mount.signals.units.unit import Unit, unit_of, units_of

_DIMENSIONS = {
    'displacement': 'length',
    'friction_force': 'force',
    'normal_force': 'force',
    'desired_displacement': 'length',
    'time': 'time',
}
NEEDED = ('displacement', 'friction_force', 'normal_force')
DESIRED = 'desired_displacement'


@dataclass(frozen=True)
class Channel:
    """Where a quantity is: column, or `topic.field`; unit and scale where said; what is subtracted then."""

    source: str
    unit: Unit | None = None
    scale: float | None = None
    offset: float | str | None = None


@dataclass(frozen=True)
class Said:
    """What the user says of friction recordings: columns by quantity, times, and what no file tells."""

    channels: Keys[str, Channel] = field(default_factory=dict)
    time: TimeChoice = field(default_factory=TimeChoice)
    stated: Stated = field(default_factory=Stated)


def said(texts: Sequence[str] = (), mapping: Mapping | None = None, stated: Stated | None = None) -> Said:
    """Return what a mapping says, and the `--channel NAME=COLUMN:UNIT` options, which go before it.

    Of a mapping these are displacement, force (or friction_force), normal force and time.
    """
    mapping = mapping or Mapping()
    channels, time = _mapped(mapping), mapping.time
    for text in texts:
        name, source, unit = _parsed(text)
        if name == 'time':
            time = TimeChoice(source, unit.symbol if unit else '')
        else:
            channels[name] = Channel(source, unit)
    return Said(channels, time, stated_with(mapping, stated))


def columns_in_si(table: MeasuredTable | Table, said: Said, needed: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the time (s) and the quantities in SI units, by channel or by heading."""
    places: dict[str, int] = {}
    factors: dict[str, float] = {}
    for name in (*NEEDED, DESIRED):
        channel = said.channels.get(name) or _by_heading(table.header, name)
        if channel is None:
            if name not in needed:
                continue
            raise IdentificationError(
                f'{table.path.name} has no column for {name} (its columns: {", ".join(table.header)}); name '
                f'it as in --channel {name}=COLUMN:UNIT'
            )
        places[name] = table.place(channel.source)
        factors[name] = _factor_of(table, places[name], name, channel)
    times, rows = _over_time(table, list(places.values()), said.time)
    found = {name: factors[name] * row for name, row in zip(places, rows, strict=True)}
    for name in found.keys() & said.channels.keys():
        offset = said.channels[name].offset
        if offset is not None:
            found[name] = found[name] - (found[name].mean() if isinstance(offset, str) else offset)
    return {'time': times, **found}


def _parsed(text: str) -> tuple[str, str, Unit | None]:
    """Return name, column and unit of a `--channel` option; raises `IdentificationError`."""
    name, equals, rest = text.partition('=')
    source, _, unit = rest.rpartition(':') if ':' in rest else (rest, '', '')
    if name not in _DIMENSIONS or not (equals and source):
        raise IdentificationError(
            f'--channel {text}: write NAME=COLUMN or NAME=COLUMN:UNIT with NAME one of '
            f'{", ".join((*NEEDED, DESIRED, "time"))}'
        )
    word = unit_word(unit, _DIMENSIONS[name]) if unit else None
    if unit and word is None:
        raise IdentificationError(
            f'--channel {text}: unit {unit!r} is none of {_DIMENSIONS[name]}; known are '
            f'{", ".join(each.symbol for each in units_of(_DIMENSIONS[name]))}'
        )
    return name, source, word


def _mapped(mapping: Mapping) -> dict[str, Channel]:
    known = {'force': 'friction_force'}
    choices = {**mapping.others, **mapping.columns}
    return {
        known.get(name, name): Channel(
            choice.column,
            _unit_said(known.get(name, name), choice) if choice.unit else None,
            choice.scale,
            choice.offset,
        )
        for name, choice in choices.items()
        if known.get(name, name) in _DIMENSIONS
    }


def _unit_said(name: str, choice: ColumnChoice) -> Unit:
    unit = unit_of(choice.unit)
    if unit.dimension != _DIMENSIONS[name]:
        raise IdentificationError(
            f'the mapping names {choice.unit} for {name} (column {choice.column}), a unit of '
            f'{unit.dimension}; it must be one of {_DIMENSIONS[name]}, such as {_example(name)}'
        )
    return unit


def _over_time(
    table: MeasuredTable | Table, places: list[int], choice: TimeChoice
) -> tuple[FloatArray, FloatArray]:
    """Return the times (s) and the columns at `places`."""
    if isinstance(table, MeasuredTable):
        return table.over_time(places, choice)
    if choice.rate is not None:
        raise IdentificationError(
            f'{table.path.name} tells its times itself; leave --rate {choice.rate:g} out'
        )
    time, *rows = table.columns(table.time_place(choice.column), *places)
    return (unit_of(choice.unit).factor if choice.unit else 1.0) * time, np.array(rows)


def _by_heading(header: Sequence[str], name: str) -> Channel | None:
    titles = (re.sub(r'\s*[\[(].*', '', each.lower()) for each in header)
    pairs = zip(header, titles, strict=True)
    return next((Channel(each) for each, title in pairs if re.fullmatch(rf'{name}(_\w+)?', title)), None)


def _factor_of(table: MeasuredTable | Table, place: int, name: str, channel: Channel) -> float:
    """Return the factor to SI: what is said goes before the header, a scale without a unit beside it."""
    scale = 1.0 if channel.scale is None else channel.scale
    if channel.unit is not None:
        return channel.unit.factor * scale
    column = table.header[place]
    header = _unit_in_header(table, place, name)
    if header is None:
        if channel.scale is not None:
            return scale
        raise IdentificationError(
            f'{table.path.name}: column {column} does not say its unit; name it as in '
            f'--channel {name}={column}:{_example(name)}'
        )
    factor = factor_beside_unit(scale, header)
    if factor is None:
        raise IdentificationError(
            f'{table.path.name}: the header of column {column} says {header.symbol} ({header.factor:g} SI '
            f'units each), the mapping a scale of {scale:g} without a unit: add unit: {header.symbol} to the '
            'scale of a calibration, or leave the scale out'
        )
    return factor


def _unit_in_header(table: MeasuredTable | Table, place: int, name: str) -> Unit | None:
    told = table.units[place] if isinstance(table, MeasuredTable) else ''
    spellings = (told, table.header[place].rpartition('_')[2])
    words = (unit_word(spelling, _DIMENSIONS[name]) for spelling in spellings if spelling)
    return next((word for word in words if word is not None), None)


def _example(name: str) -> str:
    return 'mm' if 'displacement' in name else 'N'
