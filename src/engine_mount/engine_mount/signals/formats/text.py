"""Text tables: encoding, titles and units above the samples, and the samples by pyarrow.

Where pyarrow is missing or finds a fault, the cells are read one by one, which names the fault.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.cells import (
    ALONE,
    BLANK,
    MISSING,
    cells_of,
    date_in,
    is_unit_row,
    kind_of,
    number_in,
    titles_and_units,
)
from engine_mount.signals.formats.content import Content, Leaf, Stated, with_dates
from engine_mount.signals.formats.dialect import COMMENTS, Dialect, find_dialect, is_comment, is_content
from engine_mount.signals.formats.labview import on_own_times, take_header, x_places
from engine_mount.signals.signal import SignalError

HEAD = 1 << 18
"""B at the beginning of a file by which its dialect is found, chosen: some thousand lines."""
BLOCK = 1 << 22
"""Letters read at once, chosen: larger ones are read no faster."""
_ELSEWHERE = 1 << 16  # B in the middle and at the end, chosen: a decimal sign may come late
_LONGEST = 1 << 24  # letters, chosen: a line of samples is far shorter
_GAPS = re.compile(r'\t+|\s{2,}')
_NO_SAMPLES = re.compile(r'^[ \t]*(?:(?:#|%|//)[^\n]*)?$', re.MULTILINE)
_RUNS, _ENDS = re.compile(r'[ \t]+'), re.compile(r'^\t|\t$', re.MULTILINE)


def open_text(path: Path, stated: Stated) -> Content:
    """Return the columns of a text table; raises `SignalError`."""
    codec = _codec(path)
    head = next(_blocks(path, codec, HEAD), '').split('\n')
    header = take_header(head)
    if header:
        own = Stated(header.get('Decimal_Separator', ['.'])[0], header['Separator'][0])
        stated = replace(own, **{name: said for name, said in vars(stated).items() if said})
    dialect = find_dialect(path, list(enumerate(head, 1)), _later(path, codec), stated)
    titles, units, first, notes = _titles(path, dialect, head[: dialect.first - 1])
    coarse = [place for place, kind in enumerate(dialect.kinds) if kind == 'date' and dialect.repeats(place)]
    kinds = ['text' if place in coarse else kind for place, kind in enumerate(dialect.kinds)]
    notes += [f'{titles[place]}: one date for several samples, no times of these' for place in coarse]
    if len(titles) > 1 and not titles[-1] and dialect.kinds[-1] == 'missing':
        titles = titles[:-1]  # behind a delimiter at the end of each line
    # they grow in place: what is joined of blocks would be an hour twice
    columns = [bytearray() for _ in dialect.kinds]
    times = x_places(header, len(kinds)) or [place for place, kind in enumerate(kinds) if kind == 'date'][:1]

    def prepare(numbers: Sequence[int]) -> None:
        places = list(dict.fromkeys([*numbers, *times]))
        for number, block in _samples(path, codec, dialect, first) if places else ():
            parts = _in_bulk(block, dialect, places) or _cell_by_cell(
                path, number, block, dialect, places, titles
            )
            for place, part in zip(places, parts, strict=True):
                columns[place] += part.tobytes()
        if places and not columns[places[0]]:
            raise SignalError(f'{path} holds no samples; needed are lines below the titles')

    leaves = [
        Leaf(
            name,
            None if kind == 'text'
            else partial(np.frombuffer, columns[place], 'M8[ns]' if kind == 'date' else float),
            unit, header, kind == 'date',
        )
        for place, ((name, header, unit), kind) in enumerate(
            zip(titles_and_units(titles, units), kinds, strict=False)
        )
    ]  # fmt: skip
    leaves = on_own_times(leaves, header) if header else with_dates(path, leaves)
    notes.insert(0, f'read as {dialect.told}, {codec}')
    return Content(path, 'text table', 'engine_mount.signals', leaves, notes, prepare)


def _codec(path: Path) -> str:
    """Return UTF-8 by its bytes or UTF-16 by its mark, else Windows-1252; raises `SignalError`."""
    with path.open('rb') as file:
        head = file.read(HEAD)
    if not head.strip():
        raise SignalError(f'{path} is empty; needed are lines of numbers')
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return 'utf-16'
    if 0 in head:
        raise SignalError(
            f'{path} is no text: byte {head.index(0)} is 0; give a text table in UTF-8, or name the file by '
            'its format'
        )
    try:
        codecs.getincrementaldecoder('utf-8')().decode(head)
    except UnicodeDecodeError:
        return 'cp1252'
    return 'utf-8-sig' if head.startswith(codecs.BOM_UTF8) else 'utf-8'


def _blocks(path: Path, codec: str, size: int) -> Iterator[str]:
    """Yield whole lines, each ended by a line feed but the last."""
    with path.open(encoding=codec, errors='replace') as file:
        while block := file.read(size):
            yield block + file.readline(_LONGEST)


def _later(path: Path, codec: str) -> list[str]:
    """Return some lines of the middle and of the end of a long file."""
    size, lines = path.stat().st_size, list[str]()
    if size > HEAD + 2 * _ELSEWHERE and codec != 'utf-16':
        with path.open('rb') as file:
            for place in (size // 2, size - _ELSEWHERE):
                file.seek(place)
                lines += file.read(_ELSEWHERE).decode(codec, 'replace').splitlines()[1:-1]
    return lines


# Titles.


def _titles(
    path: Path, dialect: Dialect, above: Sequence[str]
) -> tuple[list[str], list[str], int, list[str]]:
    """Return titles, units or [], the number of the first line of samples, and notes."""
    plain = [text for text in above if is_content(text)]
    found = [_as_titles(text, dialect) for text in plain]
    units = found.pop() if len(found) > 1 and found[-2] and is_unit_row(found[-1]) else []
    titles, above_titles = found[-1] if found else [], plain[: len(found) - 1]
    first, width, notes = dialect.first, len(dialect.kinds), list[str]()
    if not titles:
        cells = cells_of(plain[-1], dialect.delimiter) if plain and plain[-1] == above[-1] else []
        # the line just above the samples looks like titles of other columns
        if len(cells) > 1 and width > 1 and all(cell and not _is_number(cell) for cell in cells):
            raise SignalError(
                f'{path}, line {first - 1}: {len(cells)} titles ({", ".join(cells)[:80]}) above lines of '
                f'{width} cells ({", ".join(dialect.rows[0])[:80]}); is a decimal comma among commas? Export '
                'with semicolons, or with one title for each column'
            )
        comments = [text for text in above if is_comment(text)]
        titles, above_titles = _as_commented(comments[-1], dialect) if comments else [], plain
    if not titles:
        titles = [str(place) for place in range(width)]
        counted, behind = [cell for cell in dialect.rows[0] if cell], dialect.rows[1:]
        fractions = sum(dialect.decimal in cell for row in behind for cell in row)
        if len(counted) > 1 and counted == titles[: len(counted)] and 2 * fractions >= len(behind):
            # as an export of a frame without names begins
            titles, above_titles, first = [cell or 'index' for cell in dialect.rows[0]], [], first + 1
            notes = ['the first line is taken as numbers of the columns']
        else:
            notes = ['no titles: the columns are numbered from 0 on']
            if dialect.kinds[-1] == 'missing':
                titles[-1] = ''
    if above_titles:
        count, line = len(above_titles), above_titles[0]
        notes.insert(0, f'{count} lines before the titles are left out, the first {line[:60]!r}')
    return titles, units, first, notes


def _as_titles(text: str, dialect: Dialect) -> list[str]:
    """Return the titles in a line, [] where they are not as many as the columns, or numbers."""
    width = len(dialect.kinds)
    cells = [text.strip().strip('"')] if dialect.delimiter == ALONE else cells_of(text, dialect.delimiter)
    if dialect.delimiter == BLANK and len(cells) != width:
        cells = _GAPS.split(text.strip())
    while len(cells) > width and not cells[-1]:
        cells.pop()
    if len(cells) == width - 1 and dialect.kinds[-1] == 'missing':
        cells.append('')
    words = [cell for cell in cells if kind_of(cell, dialect.decimal) not in ('number', 'missing')]
    return cells if len(cells) == width and words else []


def _as_commented(text: str, dialect: Dialect) -> list[str]:
    """Return the titles that a comment holds, [] where it holds none."""
    bare = text.strip().lstrip(''.join(COMMENTS)).strip()
    ways = (cells_of(bare, dialect.delimiter), _GAPS.split(bare), re.split(r'\s*,\s*', bare), bare.split())
    fitting = (cells for cells in ways if len(cells) == len(dialect.kinds) and all(cells))
    return next((cells for cells in fitting if not all(map(_is_number, cells))), [])


def _is_number(cell: str) -> bool:
    return 'number' in (kind_of(cell, '.'), kind_of(cell, ','))


# Samples.


def _samples(path: Path, codec: str, dialect: Dialect, first: int) -> Iterator[tuple[int, str]]:
    """Yield whole lines with the number of the first, without titles; lines without samples are empty."""
    number = 1
    for whole in _blocks(path, codec, BLOCK):
        block, behind = whole, number + whole.count('\n')
        if number < first:
            skipped = min(first, behind) - number
            block = block.split('\n', skipped)[skipped]
            number += skipped
        if any(sign in block for sign in (*COMMENTS, '\n ', '\n\t')) or block[:1] in (' ', '\t'):
            block = _NO_SAMPLES.sub('', block)
        if dialect.delimiter == BLANK:
            block = _ENDS.sub('', _RUNS.sub('\t', block))
        if block.strip():
            yield number, block
        number = behind


def _in_bulk(block: str, dialect: Dialect, places: Sequence[int]) -> list[NDArray[Any]] | None:
    """Return the columns of a block, None where pyarrow is missing or finds a fault."""
    try:
        import pyarrow
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    number, date = pyarrow.float64(), pyarrow.timestamp('ns')
    types = {str(place): date if dialect.kinds[place] == 'date' else number for place in places}
    data = block.encode()
    try:
        table = arrow_csv.read_csv(
            pyarrow.BufferReader(data),
            arrow_csv.ReadOptions(
                use_threads=False, column_names=list(map(str, range(len(dialect.kinds)))),
                block_size=len(data) + 1,
            ),
            arrow_csv.ParseOptions(delimiter='\t' if dialect.delimiter == BLANK else dialect.delimiter),
            arrow_csv.ConvertOptions(
                check_utf8=False, column_types=types, include_columns=list(types), null_values=MISSING,
                decimal_point=dialect.decimal, quoted_strings_can_be_null=True,
            ),
            pyarrow.system_memory_pool(),  # gives back what a block took
        )  # fmt: skip
    except pyarrow.ArrowInvalid:
        return None
    if any(table.column(name).null_count for name, kind in types.items() if kind == date):
        return None
    return [  # `to_numpy` loads pandas, 40 MB
        column.to_numpy() if column.null_count or column.type == date else np.from_dlpack(column.chunk(0))
        for column in table.columns
    ]


def _cell_by_cell(
    path: Path, first: int, block: str, dialect: Dialect, places: Sequence[int], titles: Sequence[str]
) -> list[NDArray[Any]]:
    """Return the columns of a block whose first line has the number `first`; raises `SignalError`."""
    delimiter, width = '\t' if dialect.delimiter == BLANK else dialect.delimiter, len(dialect.kinds)
    dates = [dialect.kinds[place] == 'date' for place in places]
    rows = []
    for number, line in enumerate(block.split('\n'), first):
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
        row = []
        for place, date in zip(places, dates, strict=True):
            try:
                row.append(date_in(cells[place]) if date else number_in(cells[place], dialect.decimal))
            except ValueError:
                where = f'{path}, line {number}, column {titles[place]!r}'
                raise SignalError(f'{where}: {_fault(cells[place], dialect, date)}') from None
        rows.append(row)
    return [
        np.array(column, np.int64).view('datetime64[ns]') if date else np.array(column, np.float64)
        for date, column in zip(dates, zip(*rows, strict=True), strict=True)
    ]


def _fault(cell: str, dialect: Dialect, date: bool) -> str:
    sign, other = ('point', ',') if dialect.decimal == '.' else ('comma', '.')
    remedy = 'correct or remove the line'
    if not date and kind_of(cell, other) == 'number':
        remedy = 'is the decimal sign the other one? Say so with --decimal, or correct the line'
    elif not date and re.sub("[., ']", '', cell).lstrip('+-').isdecimal():
        remedy = 'export without signs between thousands'
    expected = 'a date such as 2024-05-01 12:00:00.001' if date else f'a number with decimal {sign}'
    return f'{cell!r} is no number; expected is {expected}; {remedy}'
