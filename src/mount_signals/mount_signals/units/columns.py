"""The column of a file that a user means."""

import difflib

from mount_signals.formats.measured import Measured, MeasuredColumn
from mount_signals.units.mapping import MappingError
from mount_signals.units.unit import unit_of

_SHOWN = 12  # names in a refusal, chosen: a MDF4 file can hold thousands


def column_of(measured: Measured, wanted: str) -> MeasuredColumn:
    """Return the column by name, header, or number from 0 on; raises `MappingError` with those there are, or
    `UnitError` for a unit behind its name that is not known.
    """
    columns = measured.columns
    if wanted in columns:
        return columns[wanted]
    titled = [column for column in columns.values() if wanted in (column.name, column.header)]
    if len(titled) == 1:
        return titled[0]
    if wanted.isdecimal() and int(wanted) < len(columns):
        return list(columns.values())[int(wanted)]
    by_case = [name for name in columns if name.lower() == wanted.lower()]
    near = by_case or difflib.get_close_matches(wanted, columns, n=3, cutoff=0.6)
    hint = f'is it {" or ".join(near)}? ' if near else ''
    name, colon, unit = wanted.rpartition(':')
    if colon and name in columns:
        unit_of(unit)
    raise MappingError(f'{place(measured)}: no column {wanted!r}; {hint}there are {known(measured)}')


def known(measured: Measured) -> str:
    """Return the names of the columns of a file, the first of many, for sentences."""
    shown = list(measured.columns)[:_SHOWN]
    more = len(measured.columns) - len(shown)
    return ', '.join(shown) + (f' and {more} more' if more > 0 else '') if shown else 'none'


def place(measured: Measured) -> str:
    """Return the name of the file, for sentences."""
    return measured.provenance.uri.rstrip('/').rpartition('/')[2] or measured.provenance.uri
