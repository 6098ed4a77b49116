"""Which column is which quantity of a friction recording, and its unit: by title, option or mapping."""

import re
from dataclasses import dataclass

from mount_bags.signals.table import Table
from mount_identification.friction.recording import FloatArray, IdentificationError
from mount_identification.rack.measured_table import MeasuredTable
from mount_identification.rack.unit_words import unit_word
from mount_signals.units.mapping import ColumnChoice, Mapping
from mount_signals.units.unit import unit_of, units_of

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
    """Where a quantity is: column, or `topic.field`; factor to SI units; what is subtracted then."""

    source: str
    factor: float | None = None
    offset: float | str | None = None


def parsed_channels(texts: list[str]) -> dict[str, Channel]:
    """Return the `--channel NAME=COLUMN:UNIT` options by name."""
    found = {}
    for text in texts:
        name, equals, rest = text.partition('=')
        source, _, unit = rest.rpartition(':') if ':' in rest else (rest, '', '')
        if name not in (*NEEDED, DESIRED, 'time') or not (equals and source):
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
        found[name] = Channel(source, None if word is None else word.factor)
    return found


def mapped_channels(mapping: Mapping) -> dict[str, Channel]:
    """Return what a mapping file says of displacement, force (or friction_force), normal force and time."""
    known = {'force': 'friction_force'}
    choices = {**mapping.others, **mapping.columns}
    found = {
        known.get(name, name): Channel(
            choice.column,
            None if not choice.unit and choice.scale is None else _factor_said(choice),
            choice.offset,
        )
        for name, choice in choices.items()
        if known.get(name, name) in _DIMENSIONS
    }
    if mapping.time.column:
        unit = mapping.time.unit
        found['time'] = Channel(mapping.time.column, unit_of(unit).factor if unit else None)
    return found


def _factor_said(choice: ColumnChoice) -> float:
    return (unit_of(choice.unit).factor if choice.unit else 1.0) * (
        1.0 if choice.scale is None else choice.scale
    )


def columns_in_si(
    table: MeasuredTable | Table, channels: dict[str, Channel], needed: tuple[str, ...]
) -> dict[str, FloatArray]:
    """Return the time (s) and the quantities in SI units, by channel or by heading."""
    header = list(table.header)
    places: dict[str, int] = {}
    factors: dict[str, float] = {}
    for name in (*NEEDED, DESIRED):
        channel = channels.get(name) or _by_heading(header, name)
        if channel is None:
            if name not in needed:
                continue
            raise IdentificationError(
                f'{table.path.name} has no column for {name} (its columns: {", ".join(header)}); name it as '
                f'in --channel {name}=COLUMN:UNIT'
            )
        places[name] = table.place(channel.source)
        factors[name] = _factor_of(table, places[name], name) if channel.factor is None else channel.factor
    times = table.times(places['displacement']) if isinstance(table, MeasuredTable) else None
    if times is None or 'time' in channels:
        wanted = channels.get('time', Channel(''))
        places['time'] = table.time_place(wanted.source)
        factors['time'] = _time_factor(table, places['time']) if wanted.factor is None else wanted.factor
    rows = table.columns(*places.values())
    found = {name: factors[name] * row for name, row in zip(places, rows, strict=True)}
    for name in found.keys() & channels.keys():
        offset = channels[name].offset
        if offset is not None:
            found[name] = found[name] - (found[name].mean() if isinstance(offset, str) else offset)
    return found if 'time' in found else {'time': times, **found}


def _by_heading(header: list[str], name: str) -> Channel | None:
    titles = (re.sub(r'\s*[\[(].*', '', each.lower()) for each in header)
    pairs = zip(header, titles, strict=True)
    return next((Channel(each) for each, title in pairs if re.fullmatch(rf'{name}(_\w+)?', title)), None)


def _factor_of(table: MeasuredTable | Table, place: int, name: str) -> float:
    column = table.header[place]
    told = table.units[place] if isinstance(table, MeasuredTable) else ''
    for unit in (told, column.rpartition('_')[2]):
        word = unit_word(unit, _DIMENSIONS[name]) if unit else None
        if word is not None:
            return word.factor
    raise IdentificationError(
        f'{table.path.name}: column {column} does not say its unit; name it as in --channel {name}={column}:'
        f'{"mm" if "displacement" in name else "N"}'
    )


def _time_factor(table: MeasuredTable | Table, place: int) -> float:
    """Return the factor of the times to s: that of the unit in their title, else 1."""
    told = table.units[place] if isinstance(table, MeasuredTable) else ''
    word = unit_word(told, 'time') if told else None
    return 1.0 if word is None else word.factor
