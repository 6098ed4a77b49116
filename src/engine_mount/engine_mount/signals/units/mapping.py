"""Which column is which quantity, in what unit, and what its times are: as a user says it.

One measuring system is one YAML file that a team shares; options of a command say more, or otherwise.
"""

import math
from collections.abc import Mapping as Keys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.units.quantities import is_quantity, names, quantity, quantity_of, titled
from engine_mount.signals.units.unit import UnitError, is_unit, unit_of
from mount_models.plain_yaml import YamlError, yaml_in_file

MEAN = 'mean'
"""The offset that is the mean of the signal."""
_KEYS = ('system', 'time', 'columns', 'others', 'decimal', 'delimiter')
_COLUMN_KEYS = ('column', 'unit', 'scale', 'offset')
_TIME_KEYS = ('column', 'unit', 'rate')


class MappingError(ValueError):
    """What is said of a recording is not understood, or contradicts itself; the text says what to write."""


@dataclass(frozen=True)
class ColumnChoice:
    """A column, by name or number, and what is said of it.

    `unit` is '' where none is said. `scale` is a factor on the value in its unit, as -1 of an axis that
    points down, or a calibration; where no unit is said, it leads to SI. `offset`, in SI, is subtracted:
    a number, `mean`, or None where nothing is said of it.
    """

    column: str
    unit: str = ''
    scale: float | None = None
    offset: float | str | None = None


@dataclass(frozen=True)
class TimeChoice:
    """Where times stand, and in what unit; or the rate (Hz) of a file without. '' and None: not said."""

    column: str = ''
    unit: str = ''
    rate: float | None = None


@dataclass(frozen=True)
class Mapping:
    """What is said of a recording: `columns` by quantity, `others` by names of the user's own.

    `system` says in words what measured; `options` is how a command says a column, for remedies. `decimal`
    and `delimiter` are those of text tables, see `Stated`.
    """

    columns: Keys[str, ColumnChoice] = field(default_factory=dict)
    others: Keys[str, ColumnChoice] = field(default_factory=dict)
    time: TimeChoice = TimeChoice()
    system: str = ''
    options: str = '--column {quantity}={column}:{unit}'
    decimal: str = ''
    delimiter: str = ''


def mapping_in_file(path: Path) -> Mapping:
    """Return the mapping in a YAML file, such as

    ```yaml
    system: rack 2, string potentiometer and load cell
    time: {column: t, unit: ms}            # or {rate: 1000}
    columns:
      displacement: {column: Weg, unit: mm, offset: mean}
      acceleration: {column: az, unit: g, scale: -1}
    others:
      valve_pressure: {column: p2, unit: bar}
    decimal: ","                           # of text tables that can be read in two ways; also delimiter
    ```

    Raises `MappingError`, for a key that is not known too.
    """
    try:
        content = yaml_in_file(path)
        found = _keys(content, _KEYS, 'a mapping')
        columns = {quantity(name).name: _column(value, name) for name, value in _section(found, 'columns')}
        others = {_own_name(name): _column(value, name) for name, value in _section(found, 'others')}
        time = _time(found.get('time', {}))
        system, decimal, delimiter = (_text(found, key) for key in ('system', 'decimal', 'delimiter'))
    except YamlError as error:
        raise MappingError(f'{path} {error}') from None
    except (MappingError, UnitError) as error:
        raise MappingError(f'{path}: {error}') from None
    return Mapping(columns, others, time, system, decimal=decimal, delimiter=delimiter)


def with_options(
    mapping: Mapping,
    columns: Sequence[str] = (),
    time: str = '',
    rate: float | None = None,
    scale: float | None = None,
    default: str = '',
) -> Mapping:
    """Return the mapping with what options say, which goes before what a file says.

    `columns` are `[QUANTITY=]COLUMN[:UNIT]`; where no quantity is written it is `default`, else what unit or
    title tell. `time` is `COLUMN[:UNIT]`; `scale` is that of the only column. Raises `MappingError` or
    `UnitError`.
    """
    said: dict[str, ColumnChoice] = {}
    for text in columns:
        name, choice = column_option(text, default)
        if name in said:
            raise MappingError(
                f'{name} is named twice, {said[name].column!r} and {choice.column!r}; name one'
            )
        said[name] = _over(mapping.columns.get(name), choice)
    found = replace(mapping, columns={**mapping.columns, **said})
    if scale is not None:
        found = _scaled(found, scale, tuple(said))
    if time and rate is not None:
        raise MappingError(f'--time {time} and --rate {rate:g} both tell the times; give one of them')
    if rate is not None:
        return replace(found, time=TimeChoice(rate=_positive('--rate', rate)))
    return replace(found, time=time_option(time)) if time else found


def column_option(text: str, default: str = '') -> tuple[str, ColumnChoice]:
    """Return quantity and column of `[QUANTITY=]COLUMN[:UNIT]`.

    Where no quantity is written it is `default`; without one, unit or title tell it.
    """
    name, equals, rest = text.partition('=')
    named = equals == '=' and is_quantity(name)
    column, unit = split_unit(rest if named else text)
    if not column:
        raise MappingError(f'--column {text}: write [QUANTITY=]COLUMN[:UNIT], as in acceleration=az:g')
    choice = ColumnChoice(column, unit)
    if named or default:
        return (name if named else default), choice
    found = quantity_of(unit_of(unit)) if unit else titled(column)
    if found is None:
        if ':' in column:
            unit_of(column.rpartition(':')[2])
        raise MappingError(f'--column {text}: say what it is, as in displacement={text}; known are {names()}')
    return found.name, choice


def time_option(text: str) -> TimeChoice:
    """Return the time of `COLUMN[:UNIT]`."""
    column, unit = split_unit(text)
    if unit and unit_of(unit).dimension != 'time':
        raise MappingError(f'--time {text}: {unit} is no unit of time; write s, ms, us, ns, min or h')
    return TimeChoice(column, unit)


def split_unit(text: str) -> tuple[str, str]:
    """Return column and unit of `COLUMN[:UNIT]`; what follows the colon must be a unit, else it is a name."""
    column, colon, unit = text.rpartition(':')
    return (column, unit) if colon and is_unit(unit) else (text, '')


def checked_scale(scale: Any, what: str) -> float:
    """Return a factor that is a finite number other than 0, or raise `MappingError`."""
    number = _number(scale, what)
    if number == 0.0:
        raise MappingError(f'{what} ({scale}) must be a number other than 0')
    return number


# Below: one section of the file each.


def _over(before: ColumnChoice | None, said: ColumnChoice) -> ColumnChoice:
    """Return what an option says; of the same column the file's unit, scale and offset stay."""
    if before is None or before.column != said.column:
        return said
    return replace(before, unit=said.unit or before.unit)


def _scaled(mapping: Mapping, scale: float, said: tuple[str, ...]) -> Mapping:
    names = said or tuple(mapping.columns)
    if len(names) != 1:
        raise MappingError(
            f'--scale is that of one column, {len(names)} are named; write it in the mapping file'
        )
    choice = replace(mapping.columns[names[0]], scale=checked_scale(scale, '--scale'))
    return replace(mapping, columns={**mapping.columns, names[0]: choice})


def _text(found: Keys[str, Any], name: str) -> str:
    text = found.get(name, '')
    if not isinstance(text, str):
        raise MappingError(f'{name} ({text!r}) must be a text')
    return text


def _section(found: Keys[str, Any], name: str) -> list[tuple[str, Any]]:
    section = found.get(name, {})
    if not isinstance(section, dict):
        raise MappingError(f'{name} must be names with their columns; instead it is {section!r}')
    return list(section.items())


def _column(value: Any, name: str) -> ColumnChoice:
    found = _keys(value, _COLUMN_KEYS, name)
    if 'column' not in found:
        raise MappingError(f'{name} names no column; write {name}: {{column: NAME, unit: UNIT}}')
    unit, offset = str(found.get('unit', '')), found.get('offset')
    if unit:
        unit_of(unit)
    scale = None if 'scale' not in found else checked_scale(found['scale'], f'scale of {name}')
    if offset is not None and offset != MEAN:
        offset = _number(offset, f'offset of {name}')
    return ColumnChoice(str(found['column']), unit, scale, offset)


def _time(value: Any) -> TimeChoice:
    found = _keys(value, _TIME_KEYS, 'time')
    if 'rate' in found:
        if len(found) > 1:
            raise MappingError('time has a rate and a column or unit; a rate is for files without times')
        return TimeChoice(rate=_positive('rate', _number(found['rate'], 'rate')))
    unit = str(found.get('unit', ''))
    if unit and unit_of(unit).dimension != 'time':
        raise MappingError(f'unit of time ({unit}) must be s, ms, us, ns, min or h')
    return TimeChoice(str(found.get('column', '')), unit)


def _keys(value: Any, known: Sequence[str], what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise MappingError(f'{what} must have keys with values ({", ".join(known)}); instead it is {value!r}')
    unknown = [key for key in value if key not in known]
    if unknown:
        raise MappingError(f'{what}: {", ".join(unknown)} is not known; known are {", ".join(known)}')
    return value


def _own_name(name: str) -> str:
    if is_quantity(name) or not name.isidentifier() or not name.isascii():
        raise MappingError(
            f'others: {name!r} must be a name of letters, digits and _ that is no quantity; '
            'a quantity stands below columns'
        )
    return name


def _positive(what: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise MappingError(f'{what} ({value:g}) must be a number of Hz above 0')
    return value


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise MappingError(f'{what} ({value!r}) must be a number')
    return float(value)
