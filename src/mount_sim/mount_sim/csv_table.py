"""A CSV file as a header and columns of numbers; whatever is no number is refused with its line."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


class RecordedInputError(ValueError):
    """A recorded signal cannot be used as excitation; the text says why and what would help."""


@dataclass(frozen=True)
class CsvTable:
    """Names of the columns, and the rows below them as text, each with its line number in the file."""

    path: Path
    header: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[list[str], ...]

    def columns(self, *places: int) -> NDArray[np.float64]:
        """Return the chosen columns as numbers, shape (columns, rows)."""
        values = np.empty((len(places), len(self.rows)))
        try:
            for column, place in enumerate(places):
                values[column] = np.fromiter(map(float, map(itemgetter(place), self.rows)), float)
        except (ValueError, IndexError):
            raise RecordedInputError(self._first_fault(places)) from None
        return values

    def _first_fault(self, places: Iterable[int]) -> str:
        for line, row in zip(self.lines, self.rows, strict=True):
            try:
                for place in places:
                    float(row[place])
            except (ValueError, IndexError):
                return f'{self.path}, line {line}: {",".join(row)!r} is not a line of numbers'
        raise AssertionError('there is no fault')


def read_table(path: Path) -> CsvTable:
    """Return the table in `path`; lines that begin with # are comments. Raises `RecordedInputError`."""
    with path.open(newline='', encoding='utf-8-sig', errors='replace') as stream:
        reader = csv.reader(stream)
        numbered = [(reader.line_num, row) for row in reader if row and not row[0].startswith('#')]
    if len(numbered) < 2:
        raise RecordedInputError(f'{path} holds {len(numbered)} lines; needed are a header and the samples')
    header = tuple(name.strip() for name in numbered[0][1])
    return CsvTable(
        path, header, tuple(line for line, _ in numbered[1:]), tuple(row for _, row in numbered[1:])
    )
