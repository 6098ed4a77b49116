"""The samples of a text table: by pyarrow, and cell by cell where that is missing or finds a fault."""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.text.cells import (
    BLANK,
    MISSING,
    cells_of,
    date_in,
    kind_of,
    number_in,
)
from engine_mount.signals.formats.text.dialect import Dialect
from engine_mount.signals.formats.text.lines import blocks
from engine_mount.signals.signal import SignalError

Values = NDArray[Any]
_NOT_SAMPLES = re.compile(rb'^[ \t]*(?:(?:#|%|//)[^\n]*)?$', re.MULTILINE)
_MAY_BE_NONE = (b'#', b'%', b'//', b'\n ', b'\n\t')
_RUNS = re.compile(rb'[ \t]+')
_ENDS = re.compile(rb'^\t|\t$', re.MULTILINE)


def columns_of(path: Path, dialect: Dialect, places: Sequence[int]) -> list[Values]:
    """Return the columns at `places`: numbers, NaN where missing, or dates in ns since 1970.

    Raises `SignalError` with line, column and cell.
    """
    columns = [_Growing() for _ in places]
    size, seen = path.stat().st_size, 0
    for first, block in _samples(path, dialect):
        found = _in_bulk(block, dialect, places)
        if found is None:
            found = _cell_by_cell(path, first, block, dialect, places)
        seen += len(block)
        for column, values in zip(columns, found, strict=True):
            column.add(values, size / seen)
    return [column.values for column in columns]


class _Growing:
    """A column that grows block by block, in place: put together at the end it would be held twice."""

    def __init__(self) -> None:
        self._room: Values = np.empty(0)
        self._size = 0

    @property
    def values(self) -> Values:
        """What was added."""
        return self._room[: self._size]

    def add(self, values: Values, share: float) -> None:
        """Add a block; when the whole will have `share` times what is there, room for that is made."""
        size = self._size + values.size
        if size > self._room.size:
            room = np.empty(max(size, int(_SPARE * size * share)), values.dtype)
            room[: self._size] = self.values
            self._room = room
        self._room[self._size : size] = values
        self._size = size


_SPARE = 1.02  # chosen: lines grow longer or shorter; room that is not used takes no memory


def _samples(path: Path, dialect: Dialect) -> Iterator[tuple[int, bytes]]:
    """Yield whole lines with the number of the first, without titles; lines without samples are empty."""
    number = 1
    for whole in blocks(path, dialect.encoding):
        block, behind = whole, number + whole.count(b'\n')
        if number < dialect.first:
            skipped = min(dialect.first - number, behind - number)
            block = block.split(b'\n', skipped)[skipped]
            number += skipped
        if any(sign in block for sign in _MAY_BE_NONE) or block[:1] in (b' ', b'\t'):
            block = _NOT_SAMPLES.sub(b'', block)
        if dialect.delimiter == BLANK:
            block = _ENDS.sub(b'', _RUNS.sub(b'\t', block))
        if block.strip():
            yield number, block
        number = behind


def _in_bulk(block: bytes, dialect: Dialect, places: Sequence[int]) -> list[Values] | None:
    """Return the columns of a block, None where pyarrow is missing or finds a fault."""
    try:
        import pyarrow
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    names = [str(place) for place in range(len(dialect.kinds))]
    types = {
        str(place): pyarrow.timestamp('ns') if dialect.kinds[place] == 'date' else pyarrow.float64()
        for place in places
    }
    try:
        table = arrow_csv.read_csv(
            pyarrow.BufferReader(block),
            arrow_csv.ReadOptions(use_threads=False, column_names=names, block_size=len(block) + 1),
            arrow_csv.ParseOptions(delimiter='\t' if dialect.delimiter == BLANK else dialect.delimiter),
            arrow_csv.ConvertOptions(
                check_utf8=False, column_types=types, include_columns=list(types), null_values=MISSING,
                decimal_point=dialect.decimal, quoted_strings_can_be_null=True,
            ),
            pyarrow.system_memory_pool(),  # gives back what a block took
        )  # fmt: skip
    except pyarrow.ArrowInvalid:
        return None
    found: list[Values] = []
    for place in places:
        column = table.column(str(place))
        if dialect.kinds[place] == 'date':
            if column.null_count:
                return None
            column = column.cast(pyarrow.int64())
        found.append(column.to_numpy())
    return found


def _cell_by_cell(
    path: Path, first: int, block: bytes, dialect: Dialect, places: Sequence[int]
) -> list[Values]:
    """Return the columns of a block whose first line has the number `first`; raises `SignalError`."""
    delimiter = '\t' if dialect.delimiter == BLANK else dialect.delimiter
    width = len(dialect.kinds)
    found: list[list[float]] = [[] for _ in places]
    for number, line in enumerate(block.decode(errors='replace').split('\n'), first):
        if not line:
            continue
        try:
            cells = cells_of(line, delimiter)
        except csv.Error as error:
            raise SignalError(f'{path}, line {number}: {error}; is a quote missing?') from None
        if len(cells) != width:
            raise SignalError(
                f'{path}, line {number}: {len(cells)} cells ({line.strip()[:80]!r}) where the others have '
                f'{width}; complete the line or leave it out'
            )
        for part, place in zip(found, places, strict=True):
            part.append(_value(path, number, dialect, place, cells[place]))
    kinds = [np.int64 if dialect.kinds[place] == 'date' else np.float64 for place in places]
    return [np.array(part, kind) for part, kind in zip(found, kinds, strict=True)]


def _value(path: Path, number: int, dialect: Dialect, place: int, cell: str) -> float:
    date = dialect.kinds[place] == 'date'
    try:
        return date_in(cell) if date else number_in(cell, dialect.decimal)
    except ValueError:
        pass
    title = dialect.headings[place].header if place < len(dialect.headings) else str(place)
    sign, other = ('point', 'comma') if dialect.decimal == '.' else ('comma', 'point')
    remedy = 'correct or remove the line'
    if not date and kind_of(cell, ',' if dialect.decimal == '.' else '.') == 'number':
        remedy = f'is the decimal sign a {other}? Say so with --decimal, or correct the line'
    elif not date and cell.replace('.', '').replace(',', '').replace(' ', '').lstrip('+-').isdecimal():
        remedy = 'export without signs between thousands'
    expected = 'a date such as 2024-05-01 12:00:00.001' if date else f'a number with decimal {sign}'
    raise SignalError(
        f'{path}, line {number}, column {title!r}: {cell!r} is no number; expected is {expected}; {remedy}'
    )
