"""A table as a header and columns of numbers; whatever is no number is refused with its line."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.signals.signal import FloatArray, Signal, SignalError, signal_of

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
