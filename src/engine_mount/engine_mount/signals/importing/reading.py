"""Several files read with one mapping."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.one_grid import CHASSIS, DISPLACEMENT, ENGINE
from engine_mount.signals.importing.provenance import Told, told_columns, told_source
from engine_mount.signals.signal import Signal, SignalError
from engine_mount.signals.units.columns import heading_of, is_time, place, read_chosen, stated_with
from engine_mount.signals.units.mapping import MEAN, ColumnChoice, Mapping, MappingError
from engine_mount.signals.units.quantities import Quantity, names, quantity, titled
from engine_mount.signals.units.signals import chosen_signals
from engine_mount.signals.units.unit import is_unit, unit_of


@dataclass(frozen=True, eq=False)
class Read:
    """What was chosen of a file: signals in SI by quantity, and what the session tells of file and columns.

    The columns themselves are gone: an hour of them would be held twice.
    """

    name: str
    source: Told
    columns: Told
    quantities: dict[str, Quantity]
    signals: dict[str, Signal]
    notes: tuple[str, ...]


def read_files(files: Sequence[str], mapping: Mapping, stated: Stated | None = None) -> list[Read]:
    """Return what `mapping` names of each file; without columns, what titles and units tell.

    Of several files each gives the columns that it has. Without another offset the mean of a displacement is
    its rest position. Raises `MappingError`, `UnitError`, `SignalError` or `SourceError`.
    """
    stated = stated_with(mapping, stated)
    there = {file: headings(file, stated) for file in files}
    if not mapping.columns and not mapping.others:
        mapping = told_by_titles(there, mapping)
    found = {file: _of_file(mapping, file, own, alone=len(files) == 1) for file, own in there.items()}
    wanted = {*mapping.columns, *mapping.others}
    missing = wanted - {name for own in found.values() for name in (*own.columns, *own.others)}
    if missing:
        column = {**mapping.columns, **mapping.others}[min(missing)].column
        raise MappingError(f'no file has a column {column!r} ({min(missing)}); files are {", ".join(files)}')
    return [_read(file, own, stated) for file, own in found.items() if own.columns or own.others]


def _read(file: str, mapping: Mapping, stated: Stated | None) -> Read:
    measured = read_chosen(file, mapping, stated)
    chosen = chosen_signals(measured, mapping)
    name, source, notes = place(measured), told_source(measured), measured.notes
    del measured  # an hour of columns is not held beside its signals in SI
    told = told_columns(chosen)
    quantities = {name: one.quantity for name, one in chosen.items()}
    signals = {name: chosen.pop(name).in_si() for name in list(chosen)}
    return Read(name, source, told, quantities, signals, notes)


def _of_file(mapping: Mapping, file: str, there: Sequence[Heading], *, alone: bool) -> Mapping:
    """Return what of the mapping is in a file; of one file alone all must be."""
    rested = {
        name: replace(choice, offset=MEAN)
        if name in (DISPLACEMENT, ENGINE, CHASSIS) and choice.offset is None
        else choice
        for name, choice in mapping.columns.items()
    }
    mapping = replace(mapping, columns=rested)
    return mapping if alone else part_in(mapping, there, file)


def part_in(mapping: Mapping, there: Sequence[Heading], file: str) -> Mapping:
    """Return what of `mapping` is among the columns `there` of a file."""
    columns = {name: choice for name, choice in mapping.columns.items() if _has(there, choice, file)}
    others = {name: choice for name, choice in mapping.others.items() if _has(there, choice, file)}
    return replace(mapping, columns=columns, others=others)


def _has(there: Sequence[Heading], choice: ColumnChoice, file: str) -> bool:
    try:
        heading_of(there, choice.column, file)
    except SignalError:
        return False
    return True


def told_by_titles(there: dict[str, tuple[Heading, ...]], mapping: Mapping) -> Mapping:
    """Return a mapping of the columns whose title tells the quantity and whose header tells the unit.

    `there` are the columns of files by their names. Raises `MappingError` where there are none.
    """
    columns: dict[str, ColumnChoice] = {}
    for own in there.values():
        for heading in own:
            found = titled(heading.name.rpartition('/')[2].rpartition('.')[2])
            if found is None or is_time(heading) or not is_unit(heading.unit):
                continue
            if unit_of(heading.unit).dimension == quantity(found.name).dimension:
                columns.setdefault(found.name, ColumnChoice(heading.name))
    if not columns:
        listing = '; '.join(f'{file}: {", ".join(one.name for one in own)}' for file, own in there.items())
        raise MappingError(
            'no column tells by its title and unit what it is; say it with --column QUANTITY=COLUMN:UNIT or '
            f'a mapping file. Quantities: {names()}. Columns: {listing}'
        )
    return replace(mapping, columns=columns)
