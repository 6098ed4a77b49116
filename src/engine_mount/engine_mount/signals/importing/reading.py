"""Several files read with one mapping."""

from collections.abc import Sequence
from dataclasses import replace

from engine_mount.signals.formats.measured import Heading
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.channels import CHASSIS, DISPLACEMENT, ENGINE
from engine_mount.signals.mapping import MEAN, ColumnChoice, Mapping
from engine_mount.signals.quantities import QUANTITIES, titled
from engine_mount.signals.selection import Selection, heading_of, select
from engine_mount.signals.signal import SignalError
from engine_mount.signals.times import is_time
from engine_mount.signals.units import is_unit


def read_files(files: Sequence[str], mapping: Mapping) -> list[Selection]:
    """Return what `mapping` names of each file; without columns, what titles and units tell.

    Of several files each gives the columns that it has. Without another offset the mean of a displacement is
    its rest position. Raises `SignalError` or `SourceError`.
    """
    there = {file: headings(file, mapping.stated) for file in files}
    if not mapping.choices:
        mapping = told_by_titles(there, mapping)
    found = {
        file: _rested(mapping if len(files) == 1 else part_in(mapping, own)) for file, own in there.items()
    }
    missing = set(mapping.choices) - {name for own in found.values() for name in own.choices}
    if missing:
        column = mapping.choices[min(missing)].column
        raise SignalError(f'no file has a column {column!r} ({min(missing)}); files are {", ".join(files)}')
    return [select(file, own) for file, own in found.items() if own.choices]


def part_in(mapping: Mapping, there: Sequence[Heading]) -> Mapping:
    """Return what of `mapping` is among the columns `there` of a file."""

    def part(choices: dict[str, ColumnChoice]) -> dict[str, ColumnChoice]:
        return {name: choice for name, choice in choices.items() if _has(there, choice)}

    return replace(mapping, columns=part(dict(mapping.columns)), others=part(dict(mapping.others)))


def _rested(mapping: Mapping) -> Mapping:
    rest = {
        name: replace(choice, offset=MEAN)
        for name, choice in mapping.columns.items()
        if name in (DISPLACEMENT, ENGINE, CHASSIS) and choice.offset is None
    }
    return replace(mapping, columns={**mapping.columns, **rest})


def _has(there: Sequence[Heading], choice: ColumnChoice) -> bool:
    try:
        heading_of(there, choice.column, '')
    except SignalError:
        return False
    return True


def told_by_titles(there: dict[str, tuple[Heading, ...]], mapping: Mapping) -> Mapping:
    """Return a mapping of the columns whose title tells the quantity and whose header tells the unit.

    `there` are the columns of files by their names. Raises `SignalError` where there are none.
    """
    columns: dict[str, ColumnChoice] = {}
    for heading in (heading for own in there.values() for heading in own):
        found = titled(heading.name.rpartition('/')[2].rpartition('.')[2])
        if found is not None and not is_time(heading) and is_unit(heading.unit, found.dimension):
            columns.setdefault(found.name, ColumnChoice(heading.name))
    if not columns:
        listing = '; '.join(f'{file}: {", ".join(one.name for one in own)}' for file, own in there.items())
        raise SignalError(
            'no column tells by its title and unit what it is; say it with --column QUANTITY=COLUMN:UNIT or '
            f'a mapping file. Quantities: {", ".join(QUANTITIES)}. Columns: {listing}'
        )
    return replace(mapping, columns=columns)
