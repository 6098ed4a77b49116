"""Excel workbooks: a table of each sheet, whose first row of numbers follows its titles."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from functools import partial
from itertools import chain, repeat, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.cells import is_unit_row, titles_and_units
from engine_mount.signals.formats.content import Content, Leaf, Stated, readable, with_dates
from engine_mount.signals.signal import SignalError, required

Row = tuple[Any, ...]
MOST_CELLS = 20_000_000  # of a sheet, rows times width, chosen: 160 MB
_MISSING = (None, '', '#N/A', '#NV', '-', 'NaN', 'nan')
_MOST_TITLES = 200  # rows without numbers at the beginning, chosen
_ZERO = datetime(1970, 1, 1)


def open_excel(path: Path, stated: Stated) -> Content:
    """Return the columns of a workbook; where several sheets hold numbers, one is `sheet/name`."""
    openpyxl = required('openpyxl', 'reading Excel files')
    notes: list[str] = []
    with (
        readable(path, 'Excel workbook (.xlsx)'),
        closing(openpyxl.load_workbook(path, read_only=True, data_only=True)) as book,
    ):
        sheets = {sheet.title: _leaves(path, sheet, notes) for sheet in book.worksheets}
    tables = {title: with_dates(path, leaves) for title, leaves in sheets.items() if leaves}
    if len(tables) != 1:
        notes.append(f'sheets {", ".join(tables)}: columns are sheet/name')
        tables = {
            title: [replace(leaf, name=f'{title}/{leaf.name}') for leaf in leaves]
            for title, leaves in tables.items()
        }
    return Content(path, 'Excel', 'openpyxl', list(chain(*tables.values())), notes)


def _rows(path: Path, sheet: Any) -> Iterator[Row]:
    """Yield the rows of a sheet without spaces about texts; one far cell makes a row as wide as the sheet."""
    cells = 0
    for row in sheet.iter_rows(values_only=True):
        cells += len(row)
        if cells > MOST_CELLS:
            raise SignalError(
                f'{path}, sheet {sheet.title!r} has more than {MOST_CELLS} cells (limit), {len(row)} '
                'in a row: remove the cells far right, or export the sheet as CSV and read that'
            )
        yield tuple(cell.strip() if isinstance(cell, str) else cell for cell in row)


def _leaves(path: Path, sheet: Any, notes: list[str]) -> list[Leaf]:
    """Return the columns of a sheet, none where it holds no numbers."""
    rows, title = list(_rows(path, sheet)), sheet.title
    pairs = zip(rows[:_MOST_TITLES], [*rows[1:], *rows[-1:]], strict=False)
    first = next((number for number, (row, below) in enumerate(pairs) if _is_sample(row, below)), None)
    if first is None:
        return []
    above = [tuple('' if cell is None else str(cell) for cell in row) for row in rows[:first] if any(row)]
    units = above.pop() if len(above) > 1 and is_unit_row(above[-1]) else ()
    titles = above[-1] if above else ()
    if not above:
        notes.append(f'{title}: no titles, the columns are numbered from 0 on')
    samples = rows[first:]
    while samples and not any(cell is not None for cell in samples[-1]):
        samples.pop()
    columns = list(zip_longest(*samples))
    padded = chain(titles, repeat(''))
    names = [next(padded) or str(place) for place in range(len(columns))]
    found = []
    for place, (name, header, unit) in enumerate(titles_and_units(names, units)):
        known = [cell for cell in columns[place] if cell not in _MISSING]
        if known and _is_value(known[0]):
            number = _is_number(known[0])
            read = partial(_values, f'{path}, sheet {title!r}', columns[place], place, first, number)
            found.append(Leaf(name, read, unit, header, date=not number))
        elif known or header != str(place):
            why = 'text' if known else 'nothing (formulas that were never calculated?)'
            notes.append(f'{title}: column {header!r} holds {why}, left out')
    return found


def _is_sample(row: Row, below: Row) -> bool:
    """Return whether a row holds numbers as the next one does, and no text above a number."""
    filled, needed = ({place for place, cell in enumerate(one) if _is_value(cell)} for one in (row, below))
    texts = {place for place, cell in enumerate(row) if isinstance(cell, str) and cell not in _MISSING}
    return any(map(_is_number, row)) and bool(filled & needed) and not texts & needed


def _values(where: str, cells: Sequence[Any], place: int, first: int, number: bool) -> np.ndarray:
    """Return a column of numbers or dates, NaN or NaT where a cell is empty; raises `SignalError`."""
    found: list[Any] = []
    for at, cell in enumerate(cells, first + 1):
        if cell in _MISSING:
            found.append(np.nan if number else None)
        elif _is_value(cell) and _is_number(cell) == number:
            found.append(cell if number else _moment(cell))
        else:
            from openpyxl.utils import get_column_letter

            raise SignalError(
                f'{where}, cell {get_column_letter(place + 1)}{at}: {str(cell)[:40]!r} '
                f'is no {"number" if number else "date"}; enter it as one, or remove the row'
            )
    return np.array(found, np.float64 if number else 'datetime64[us]')


def _is_number(cell: Any) -> bool:
    return isinstance(cell, int | float)


def _is_value(cell: Any) -> bool:
    return isinstance(cell, int | float | date | time | timedelta)


def _moment(cell: Any) -> datetime:
    """Return a date, or a time of day or a span as one after 1970."""
    if isinstance(cell, time):
        return datetime.combine(_ZERO, cell)
    return _ZERO + cell if isinstance(cell, timedelta) else cell
