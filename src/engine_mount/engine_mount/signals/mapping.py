"""Which column is which quantity, in what unit, and what its times are: as a user says it.

One measuring system is one YAML file that a team shares; options of a command say more, or otherwise.
"""

import math
from collections.abc import Mapping as Keys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.formats.content import NOT_STATED, Stated
from engine_mount.signals.quantities import QUANTITIES, Quantities, quantity, titled
from engine_mount.signals.signal import SignalError
from engine_mount.signals.units import is_unit, unit_of
from mount_models.plain_yaml import YamlError, yaml_in_file

MEAN = 'mean'
"""The offset that is the mean of the signal."""


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

    def __post_init__(self) -> None:
        """Raise `SignalError` for what cannot be meant."""
        if self.unit:
            unit_of(self.unit)
        if not (self.scale is None or (_is_number(self.scale) and self.scale)):
            raise SignalError(f'scale ({self.scale!r}) must be a number other than 0')
        if not (self.offset in (None, MEAN) or _is_number(self.offset)):
            raise SignalError(f'offset ({self.offset!r}) must be a number, or {MEAN}')


@dataclass(frozen=True)
class TimeChoice:
    """Where times stand, and in what unit; or the rate (Hz) of a file without. '' and None: not said."""

    column: str = ''
    unit: str = ''
    rate: float | None = None

    def __post_init__(self) -> None:
        """Raise `SignalError` for what cannot be meant."""
        if self.unit and not is_unit(self.unit, 'time'):
            raise SignalError(f'unit of time ({self.unit}) must be s, ms, us, ns, min or h')
        if not (self.rate is None or (_is_number(self.rate) and self.rate > 0.0)):
            raise SignalError(f'rate ({self.rate!r} Hz) must be a number above 0')
        if self.rate is not None and self.column:
            raise SignalError(
                f'column {self.column!r} and a rate of {self.rate:g} Hz both say the times; a rate is for '
                'files without times: give one of them'
            )


@dataclass(frozen=True)
class Mapping:
    """What is said of a recording: `columns` by quantity, `others` by names of the user's own.

    `system` says in words what measured; `option` is how a command says a column, for remedies. `stated` is
    what no column tells of the file.
    """

    columns: Keys[str, ColumnChoice] = field(default_factory=dict)
    others: Keys[str, ColumnChoice] = field(default_factory=dict)
    time: TimeChoice = TimeChoice()
    system: str = ''
    option: str = '--column {quantity}={column}:{unit}'
    stated: Stated = NOT_STATED

    @property
    def choices(self) -> dict[str, ColumnChoice]:
        """All columns that are named."""
        return {**self.others, **self.columns}

    def only(self, columns: Keys[str, ColumnChoice]) -> 'Mapping':
        """Return the mapping with these columns alone."""
        return replace(self, columns=dict(columns), others={})

    def for_session(self, file: str = '') -> dict[str, Any]:
        """Return what a session says of it: its `file`, the measuring system, times that were said."""
        times = {name: value for name, value in asdict(self.time).items() if value}
        said = {'file': Path(file).name, 'system': self.system, 'time': times}
        return {name: value for name, value in said.items() if value}

    def of(self, known: Quantities) -> 'Mapping':
        """Return the mapping of the `known` quantities alone, by the names that these have."""
        there = {
            name: self.choices.get(name, self.choices.get(one.mapped or name)) for name, one in known.items()
        }
        return self.only({name: choice for name, choice in there.items() if choice is not None})


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

    Raises `SignalError`, for a key that is not known too.
    """
    keys = ('system', 'time', 'columns', 'others', 'decimal', 'delimiter')
    try:
        found = _section(yaml_in_file(path), keys, 'a mapping')
        columns, others = (_section(found.get(name, {}), None, name) for name in ('columns', 'others'))
        for name in others:
            if name in QUANTITIES or not (name.isidentifier() and name.isascii()):
                raise SignalError(
                    f'others: {name!r} must be a name of letters, digits and _ that is no quantity; '
                    'a quantity stands below columns'
                )
        return Mapping(
            {quantity(name).name: _column(one, name) for name, one in columns.items()},
            {name: _column(one, name) for name, one in others.items()},
            TimeChoice(**_section(found.get('time', {}), ('column', 'unit', 'rate'), 'time')),
            str(found.get('system', '')),
            stated=Stated(str(found.get('decimal', '')), str(found.get('delimiter', ''))),
        )
    except YamlError as error:
        raise SignalError(f'{path} {error}') from None
    except SignalError as error:
        raise SignalError(f'{path}: {error}') from None


def with_options(
    mapping: Mapping,
    columns: Sequence[str] = (),
    time: str = '',
    rate: float | None = None,
    scale: float | None = None,
    default: str = '',
    known: Quantities = QUANTITIES,
    stated: Stated = NOT_STATED,
) -> Mapping:
    """Return the mapping with what options say, which goes before what a file says.

    `columns` are `[QUANTITY=]COLUMN[:UNIT]`; where no quantity is written it is `default`, else what unit or
    title tell; `time=COLUMN[:UNIT]` among them is as `time`. `scale` is that of the columns named. Raises
    `SignalError`.
    """
    said: dict[str, ColumnChoice] = {}
    for text in columns:
        if text.startswith('time='):
            time = text.removeprefix('time=')
            continue
        name, choice = _column_option(text, default, known)
        if name in said:
            raise SignalError(f'{name} is named twice, {said[name].column!r} and {choice.column!r}; name one')
        before = mapping.columns.get(name, choice)
        same = before.column == choice.column
        said[name] = replace(before, unit=choice.unit or before.unit) if same else choice
    if scale is not None:
        said = {name: replace(one, scale=scale) for name, one in (said or mapping.columns).items()}
    times = TimeChoice(*split_unit(time), rate) if time or rate is not None else mapping.time
    file = mapping.stated
    stated = Stated(
        stated.decimal or file.decimal, stated.delimiter or file.delimiter, stated.dbc or file.dbc
    )
    return replace(mapping, columns={**mapping.columns, **said}, time=times, stated=stated)


def split_unit(text: str, dimension: str = '') -> tuple[str, str]:
    """Return column and unit of `COLUMN[:UNIT]`; what follows the colon must be a unit, else it is a name."""
    column, colon, unit = text.rpartition(':')
    if colon and is_unit(unit, dimension):
        return column, unit_of(unit, dimension).symbol
    return (column, unit) if colon and is_unit(unit) else (text, '')


def _column_option(text: str, default: str, known: Quantities) -> tuple[str, ColumnChoice]:
    """Return quantity and column of `[QUANTITY=]COLUMN[:UNIT]`; raises `SignalError`.

    Where no quantity is written it is `default`; without one, unit or title tell it.
    """
    name, _, rest = text.partition('=')
    if not (name in known and rest):
        name, rest = default, text
    column, unit = split_unit(rest, known[name].dimension if name in known else '')
    if not column:
        raise SignalError(f'--column {text}: write [QUANTITY=]COLUMN[:UNIT], as in acceleration=az:g')
    if name:
        return name, ColumnChoice(column, unit)
    dimension = unit_of(unit).dimension if unit else ''
    found = next((one for one in known.values() if one.dimension == dimension), titled(column, known))
    if found is None:
        if ':' in column:
            unit_of(column.rpartition(':')[2])
        raise SignalError(
            f'--column {text}: say what it is, as in {next(iter(known))}={text}; known are {", ".join(known)}'
        )
    return found.name, ColumnChoice(column, unit)


def _column(value: Any, name: str) -> ColumnChoice:
    found = _section(value, ('column', 'unit', 'scale', 'offset'), name)
    if 'column' not in found:
        raise SignalError(f'{name} names no column; write {name}: {{column: NAME, unit: UNIT}}')
    return ColumnChoice(**{**found, 'column': str(found['column'])})


def _section(value: Any, known: Sequence[str] | None, what: str) -> dict[str, Any]:
    """Return a section of a file that has no other keys than `known`; raises `SignalError`."""
    if not isinstance(value, dict):
        raise SignalError(f'{what} must have keys with values; instead it is {value!r}')
    unknown = [str(key) for key in value if known and key not in known]
    if unknown:
        raise SignalError(f'{what}: {", ".join(unknown)} is not known; known are {", ".join(known or ())}')
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
