"""Excel workbooks: a table of each sheet, whose first row of numbers follows its titles."""

import zipfile
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.extras import required
from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.headers import in_unit_row, is_unit, name_and_unit
from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase, unique
from engine_mount.signals.signal import SignalError

_SECOND = 1_000_000_000  # ns
_MISSING = ('', '#N/A', '#NV', '-', 'NaN', 'nan')
_MOST_TITLES = 200  # rows without numbers at the beginning, chosen
_LARGEST = 1 << 29  # bytes of a workbook when unpacked, chosen: a full sheet of a million rows of ten numbers

_MOST_CELLS = 20_000_000  # of a sheet, rows times width, chosen: 160 MB


@dataclass(frozen=True)
class _Sheet:
    """The table of a sheet: its rows of cells from the first sample on, which is row `first` from 1 on."""

    title: str
    headings: tuple[Heading, ...]
    first: int
    rows: list[tuple[Any, ...]]


class Workbook:
    """A workbook; where several sheets hold numbers, a column is `sheet/name`."""

    def __init__(self, path: Path, stated: Stated):
        openpyxl = required('openpyxl', 'reading Excel files')
        self.format, self.reader, self.notes = 'Excel', 'openpyxl', []
        self._path = path
        with reading(path, 'Excel workbook (.xlsx)'):
            _check_size(path)
            with closing(openpyxl.load_workbook(path, read_only=True, data_only=True)) as book:
                tables = [(sheet.title, list(_rows(path, sheet))) for sheet in book.worksheets]
        sheets = [sheet for title, rows in tables if (sheet := self._sheet(title, rows)) is not None]
        if not sheets:
            raise SignalError(f'{path} holds no table of numbers in any of its {len(tables)} sheets')
        if len(sheets) > 1:
            self.notes.append(f'sheets {", ".join(sheet.title for sheet in sheets)}: columns are sheet/name')
        self._places: list[tuple[_Sheet, int]] = []
        found = []
        for sheet in sheets:
            before = f'{sheet.title}/' if len(sheets) > 1 else ''
            for heading in sheet.headings:
                self._places.append((sheet, heading.number))
                found.append(replace(heading, name=f'{before}{heading.name}'))
        self.headings: Sequence[Heading] = unique(found)

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen columns, on the times of the first column of dates of their sheet, if any."""
        times: dict[str, TimeBase | None] = {}
        found = []
        for heading in chosen:
            sheet, place = self._places[heading.number]
            if sheet.title not in times:
                times[sheet.title] = self._time(sheet)
            found.append(heading.measured(self._values(sheet, place), times[sheet.title]))
        return found

    def _sheet(self, title: str, rows: list[tuple[Any, ...]]) -> _Sheet | None:
        """Return the table of a sheet, None where it holds no numbers."""
        first = next(
            (number for number, row in enumerate(rows[:_MOST_TITLES]) if _is_samples(row, rows, number)), None
        )
        if first is None:
            return None
        above = [row for row in rows[:first] if any(cell is not None for cell in row)]
        units = _padded(above[-1], rows[first]) if len(above) > 1 and _is_unit_row(above[-1]) else None
        names = above[-2 if units else -1] if above else ()
        headings, dated = [], any(_is_date(cell) for cell in rows[first])
        for place, cell in enumerate(rows[first]):
            told = names[place] if place < len(names) and names[place] is not None else None
            header = str(place if told is None else told).strip()
            name, unit = name_and_unit(header)
            if units and units[place]:
                unit = str(units[place]).strip('[]() ')
            if _is_number(cell) or _is_date(cell):
                date_cell = _is_date(cell)
                headings.append(Heading(name, header, 's' if date_cell else unit, place, dated, date_cell))
            elif cell is not None:
                self.notes.append(f'{title}: column {header!r} holds text, left out')
        if not above:
            self.notes.append(f'{title}: no titles, the columns are numbered from 0 on')
        return _Sheet(title, tuple(headings), first + 1, _without_blank_end(rows[first:]))

    def _time(self, sheet: _Sheet) -> TimeBase | None:
        dated = next((one for one in sheet.headings if one.date), None)
        if dated is None:
            return None
        stamps = self._values(sheet, dated.number)
        if np.isnan(stamps).any():
            place = int(np.argmax(np.isnan(stamps)))
            raise SignalError(
                f'{self._path}, sheet {sheet.title!r}, cell {_cell(dated.number, sheet.first + place)}: the '
                'date is missing; fill it in or remove the row'
            )
        begin = float(np.floor(stamps[0]))
        return TimeBase(
            stamps - begin, int(begin) * _SECOND, f'dates in column {dated.header!r}, taken as UTC'
        )

    def _values(self, sheet: _Sheet, place: int) -> np.ndarray:
        return np.fromiter(self._numbers(sheet, place), np.float64, len(sheet.rows))

    def _numbers(self, sheet: _Sheet, place: int) -> Iterator[float]:
        for number, row in enumerate(sheet.rows, sheet.first):
            cell: Any = row[place] if place < len(row) else None
            if _is_number(cell):
                yield float(cell)
            elif _is_date(cell):
                yield _seconds(cell)
            elif cell is None or (isinstance(cell, str) and cell.strip() in _MISSING):
                yield float('nan')
            else:
                raise SignalError(
                    f'{self._path}, sheet {sheet.title!r}, cell {_cell(place, number)}: {str(cell)[:40]!r} '
                    'is no number; enter it as a number, or remove the row'
                )


def _rows(path: Path, sheet: Any) -> Iterator[tuple[Any, ...]]:
    """Give the rows of a sheet; one far cell makes a row as wide as the sheet."""
    cells = 0
    for row in sheet.iter_rows(values_only=True):
        cells += len(row)
        if cells > _MOST_CELLS:
            raise SignalError(
                f'{path}, sheet {sheet.title!r} has more than {_MOST_CELLS} cells (limit), {len(row)} '
                'in a row: remove the cells far right, or export the sheet as CSV and read that'
            )
        yield row


def _is_samples(row: tuple[Any, ...], rows: list[tuple[Any, ...]], number: int) -> bool:
    """Whether a row holds numbers wherever the next one does."""
    if not any(_is_number(cell) for cell in row):
        return False
    behind = rows[number + 1] if number + 1 < len(rows) else row
    filled = [place for place, cell in enumerate(behind) if _is_number(cell) or _is_date(cell)]
    present = [place for place, cell in enumerate(row) if _is_number(cell) or _is_date(cell)]
    return bool(filled) and set(present) >= set(filled)


def _is_unit_row(row: tuple[Any, ...]) -> bool:
    told = [cell for cell in row if cell is not None]
    texts = all(isinstance(cell, str) and in_unit_row(cell) for cell in told)
    return texts and any(is_unit(str(cell).strip('[]()')) for cell in told)


def _padded(row: tuple[Any, ...], like: tuple[Any, ...]) -> tuple[Any, ...]:
    return row + (None,) * (len(like) - len(row))


def _without_blank_end(rows: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    while rows and all(cell is None for cell in rows[-1]):
        rows = rows[:-1]
    return rows


def _is_number(cell: Any) -> bool:
    return isinstance(cell, int | float)


def _is_date(cell: Any) -> bool:
    return isinstance(cell, date | time | timedelta)


def _seconds(cell: Any) -> float:
    """Return a date in s since 1970, a time of day or a span in s."""
    if isinstance(cell, datetime):
        return cell.replace(tzinfo=UTC).timestamp()
    if isinstance(cell, date):
        return datetime(cell.year, cell.month, cell.day, tzinfo=UTC).timestamp()
    if isinstance(cell, time):
        return cell.hour * 3600.0 + cell.minute * 60.0 + cell.second + cell.microsecond * 1e-6
    return float(cell.total_seconds())


def _cell(place: int, row: int) -> str:
    letters = ''
    place += 1
    while place:
        place, rest = divmod(place - 1, 26)
        letters = chr(65 + rest) + letters
    return f'{letters}{row}'


def _check_size(path: Path) -> None:
    """Raise `SignalError` where a workbook unpacks to more than may be read."""
    with zipfile.ZipFile(path) as archive:
        size = sum(part.file_size for part in archive.infolist())
    if size > _LARGEST:
        raise SignalError(
            f'{path} unpacks to {size} bytes (limit {_LARGEST}): export the sheet as CSV and read that'
        )
