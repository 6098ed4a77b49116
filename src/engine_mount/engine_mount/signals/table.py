"""A CSV or JSON file as a table of numbers; whatever is no number is refused with its line."""

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.signal import FloatArray, Signal, SignalError, signal_of

_TIME_NAMES = ('t', 'time', 'timestamp', 'time_s', 't_s', 'seconds')


@dataclass(frozen=True, eq=False)
class Table:
    """Names of the columns, and the rows below them as they were read, each with its `line` in the file."""

    path: Path
    header: tuple[str, ...]
    lines: Sequence[int]
    rows: Sequence[Sequence[Any]]

    def columns(self, *places: int) -> FloatArray:
        """Return the chosen columns as numbers, shape (columns, rows)."""
        values = np.empty((len(places), len(self.rows)))
        try:
            for column, place in enumerate(places):
                values[column] = np.fromiter(map(float, map(itemgetter(place), self.rows)), float)
        except (ValueError, IndexError, TypeError):
            raise SignalError(self._first_fault(places)) from None
        return values

    def place(self, column: str, what: str = 'column') -> int:
        """Return the place of a column by its header or its number."""
        if column in self.header:
            return self.header.index(column)
        if column.isdecimal() and int(column) < len(self.header):
            return int(column)
        raise SignalError(
            f'{what} {column!r} is not in {self.path}; its columns are {", ".join(self.header)}'
        )

    def time_place(self, column: str = '') -> int:
        """Return the place of the times: `column`, else one by its usual names, else the first."""
        usual = next((name for name in self.header if name.lower() in _TIME_NAMES), '0')
        return self.place(column or usual, 'time column')

    def signal(self, column: str, time_column: str = '') -> Signal:
        """Return the signal in `column`."""
        place, time_place = self.place(column), self.time_place(time_column)
        times, values = self.columns(time_place, place)
        return signal_of(self.header[place], times, values)

    def _first_fault(self, places: Iterable[int]) -> str:
        for line, row in zip(self.lines, self.rows, strict=True):
            try:
                for place in places:
                    float(row[place])
            except (ValueError, IndexError, TypeError):
                return f'{self.path}, line {line}: {",".join(map(str, row))!r} is not a line of numbers'
        raise AssertionError('there is no fault')


def read_csv(path: Path) -> Table:
    """Return the table in `path`; lines that begin with # are comments. Raises `SignalError`."""
    with path.open(newline='', encoding='utf-8-sig', errors='replace') as stream:
        reader = csv.reader(stream)
        numbered = [(reader.line_num, row) for row in reader if row and not row[0].startswith('#')]
    if len(numbered) < 2:
        raise SignalError(f'{path} holds {len(numbered)} lines; needed are a header and the samples')
    header = tuple(name.strip() for name in numbered[0][1])
    return Table(path, header, [line for line, _ in numbered[1:]], [row for _, row in numbered[1:]])


def read_json(path: Path) -> Table:
    """Return the rows in `path`, the columns named by their numbers from 0 on. Raises `SignalError`."""
    try:
        rows = json.loads(path.read_text(encoding='utf-8'))['data']
        widths = {len(row) for row in rows}
    except (ValueError, KeyError, TypeError) as error:
        raise SignalError(
            f'{path} is no table ({error!r}); expected is {{"data": [[number, ...], ...]}}'
        ) from None
    if len(widths) != 1:
        raise SignalError(
            f'{path}: its {len(rows)} rows hold {", ".join(map(str, sorted(widths))) or "no"} numbers; all '
            'must hold the same'
        )
    return Table(path, tuple(map(str, range(widths.pop()))), range(1, len(rows) + 1), rows)
