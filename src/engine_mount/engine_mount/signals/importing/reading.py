"""A file read for an import: what is named, or what titles and units tell."""

from dataclasses import replace
from pathlib import Path

from engine_mount.signals.formats.measured import listed
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.channels import CHASSIS, DISPLACEMENT, ENGINE
from engine_mount.signals.mapping import MEAN, ColumnChoice, Mapping
from engine_mount.signals.quantities import QUANTITIES, titled
from engine_mount.signals.selection import Selection, select
from engine_mount.signals.signal import SignalError
from engine_mount.signals.times import is_time
from engine_mount.signals.units import is_unit


def read_file(file: str | Path, mapping: Mapping) -> Selection:
    """Return what `mapping` names of a file; without columns, what titles and units tell.

    Without another offset the mean of a displacement is its rest position. Raises `SignalError` or
    `SourceError`.
    """
    columns = dict(mapping.columns) if mapping.choices else _columns_by_titles(file, mapping)
    for name in {DISPLACEMENT, ENGINE, CHASSIS} & columns.keys():
        if columns[name].offset is None:
            columns[name] = replace(columns[name], offset=MEAN)
    return select(file, replace(mapping, columns=columns))


def _columns_by_titles(file: str | Path, mapping: Mapping) -> dict[str, ColumnChoice]:
    """Return the columns whose title tells the quantity and whose header tells the unit."""
    there = headings(file, mapping.stated)
    columns: dict[str, ColumnChoice] = {}
    for heading in there:
        found = titled(heading.name.rpartition('/')[2].rpartition('.')[2])
        if found is not None and not is_time(heading) and is_unit(heading.unit, found.dimension):
            columns.setdefault(found.name, ColumnChoice(heading.name))
    if not columns:
        raise SignalError(
            f'{file}: no column tells by its title and unit what it is; say it with --column '
            f'QUANTITY=COLUMN:UNIT or a mapping file. Quantities: {", ".join(QUANTITIES)}. Columns: '
            f'{listed(there)}'
        )
    return columns
