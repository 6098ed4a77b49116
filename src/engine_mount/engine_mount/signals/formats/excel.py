"""Excel workbooks: each sheet is read as a text table, with tabs between the cells of a row."""

import csv
from collections.abc import Sequence
from contextlib import closing
from datetime import datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from engine_mount.signals.formats.cells import ALONE
from engine_mount.signals.formats.content import Content, Leaf, Stated, readable
from engine_mount.signals.formats.text import open_text
from engine_mount.signals.signal import SignalError, required

MOST_CELLS = 20_000_000  # of a sheet, rows times width, chosen: 160 MB
_ZERO = datetime(1970, 1, 1)


def open_excel(path: Path, stated: Stated) -> Content:
    """Return the columns of a workbook; where several sheets hold numbers, one is `sheet/name`."""
    openpyxl = required('openpyxl', 'reading Excel files')
    folder, sheets, notes = TemporaryDirectory(), dict[str, Content](), list[str]()
    with (
        readable(path, 'Excel workbook (.xlsx)'),
        closing(openpyxl.load_workbook(path, read_only=True, data_only=True)) as book,
    ):
        for sheet in book.worksheets:
            rows = _rows(path, sheet)
            text = Path(folder.name, f'{path.name}, sheet {sheet.title}')
            with text.open('w', encoding='utf-8', newline='') as file:
                csv.writer(file, delimiter='\t', lineterminator='\n').writerows(rows)
            try:
                sheets[sheet.title] = open_text(text, Stated('.', 'tab' if len(rows[0]) > 1 else ALONE))
            except SignalError as error:
                notes.append(f'left out: {str(error).replace(f"{folder.name}/", "")}')
    if len(sheets) != 1:
        notes.append(f'sheets {", ".join(sheets)}: columns are sheet/name')
    found: list[tuple[Content, int, Leaf]] = []
    for title, content in sheets.items():
        notes += [f'{title}: {note}' for note in content.notes[1:]]  # the first tells of tabs
        for place, leaf in enumerate(content.leaves):
            name = leaf.name or str(place)
            found.append(
                (content, place, leaf._replace(name=name if len(sheets) == 1 else f'{title}/{name}'))
            )

    def prepare(numbers: Sequence[int]) -> None:
        for content in sheets.values():
            try:
                content.prepare([found[one][1] for one in numbers if found[one][0] is content])
            except SignalError as error:
                raise SignalError(str(error).replace(folder.name, str(path.parent))) from None

    return Content(path, 'Excel', 'openpyxl', [leaf for _, _, leaf in found], notes, prepare)


def _rows(path: Path, sheet: Any) -> list[list[str]]:
    """Return the cells of a sheet as texts; one far cell makes a row as wide as the sheet."""
    rows, cells, width = [], 0, 1
    for row in sheet.iter_rows(values_only=True):
        cells, width = cells + len(row), max(width, len(row))
        if cells > MOST_CELLS:
            raise SignalError(
                f'{path}, sheet {sheet.title!r} has more than {MOST_CELLS} cells (limit), {len(row)} '
                'in a row: remove the cells far right, or export the sheet as CSV and read that'
            )
        rows.append(list(map(_text_of, row)))
    return [row + [''] * (width - len(row)) for row in rows] or [['']]


def _text_of(cell: Any) -> str:
    if isinstance(cell, timedelta):
        cell = _ZERO + cell
    elif isinstance(cell, bool):
        cell = int(cell)
    return '' if cell is None else ' '.join(str(cell).split())
