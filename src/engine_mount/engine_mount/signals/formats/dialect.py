"""Which delimiter and decimal sign a text table has: those under which its lines are a table of numbers.

Every pair of the two is tried. Those under which the lines have equal widths and each column holds one kind
of cells are possible; of these the ones with the fewest columns of text stay. Where more than one is left and
they differ, the titles decide; where these do not either, the table is refused.
"""

import operator
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from engine_mount.signals.formats.cells import ALONE, BLANK, cells_of, kind_of
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.signal import SignalError

COMMENTS = ('#', '%', '//')
_NAMES = {
    ';': 'semicolon', '\t': 'tab', ',': 'comma', '|': 'stroke', BLANK: 'blanks', ALONE: 'one column',
}  # fmt: skip
_STATED = {'tab': '\t', '\\t': '\t', ' ': BLANK}
_MOST = 2000  # lines that are looked at, chosen
_GROUPED = re.compile(r'[+-]?(?!0)\d{1,3}[.,]\d{3}')
_ENOUGH = 0.5  # of the lines behind the first that fits, chosen: fewer are no table
Lines = Sequence[tuple[int, str]]
"""Lines of a file with their numbers from 1 on."""


class Dialect(NamedTuple):
    """One way to read the lines: the kinds of the columns, and which line is the first of the samples.

    `rows` are the cells of the samples that were looked at.
    """

    delimiter: str
    decimal: str
    kinds: tuple[str, ...]
    first: int
    rows: tuple[tuple[str, ...], ...]

    @property
    def told(self) -> str:
        """The dialect in words."""
        name = _NAMES.get(self.delimiter, repr(self.delimiter))
        return f'{name}, decimal {"point" if self.decimal == "." else "comma"}'

    def repeats(self, place: int) -> bool:
        """Return whether most samples hold what the one before holds in the column at `place`."""
        cells = [row[place] for row in self.rows if len(row) == len(self.kinds)]
        return 2 * sum(map(operator.eq, cells, cells[1:])) > len(cells)

    @property
    def texts(self) -> float:
        """Share of columns that hold text."""
        return self.kinds.count('text') / len(self.kinds)


def find_dialect(path: Path, head: Lines, later: Sequence[str], stated: Stated) -> Dialect:
    """Return how to read the lines at the beginning, `head`, and those `later`; raises `SignalError`."""
    lines = [(number, text) for number, text in head if is_content(text)]
    later = [text for text in later if is_content(text)]
    delimiters = [_STATED.get(stated.delimiter, stated.delimiter)] if stated.delimiter else _NAMES
    tried = [_table(lines, later, sign, decimal) for sign in delimiters for decimal in stated.decimal or '.,']
    possible = [dialect for dialect in tried if dialect is not None]
    least = min((dialect.texts for dialect in possible), default=0.0)
    found: list[Dialect] = []
    for dialect in possible:
        if dialect.texts == least and not any(_same(dialect, other) for other in found):
            found.append(dialect)
    if len(found) > 1:
        found = [dialect for dialect in found if _fits_titles(dialect, lines)] or found
    if not found:
        if not lines:
            raise SignalError(f'{path} holds comments and blank lines only; needed are lines of numbers')
        number, text = lines[len(lines) // 2]
        raise SignalError(
            f'{path}, line {number}: {text.strip()[:80]!r} is no line of a table of numbers; expected are '
            'lines of equally many cells between semicolons, tabs, commas or blanks, decimal point or comma, '
            'no signs between thousands'
        )
    if len(found) > 1:
        ways = ' or '.join(
            f'{dialect.told} ({", ".join(dialect.rows[0][:4]).replace(chr(9), " ")})' for dialect in found
        )
        raise SignalError(
            f'{path} can be read as {ways}; state --decimal or --delimiter, or export with semicolons'
        )
    if not stated.decimal:
        _refuse_thousands(path, found[0])
    return found[0]


def is_comment(line: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip().startswith(COMMENTS)


def is_content(line: str) -> bool:
    """Return whether a line is neither blank nor a comment."""
    return bool(line.strip()) and not is_comment(line)


def _table(lines: Lines, later: Sequence[str], delimiter: str, decimal: str) -> Dialect | None:
    """Return the table that lines are under a delimiter and a decimal sign, None where they are none."""
    rows = [tuple(cells_of(text, delimiter)) for _, text in lines[:_MOST]]
    half = rows[len(rows) // 2 :] + [tuple(cells_of(text, delimiter)) for text in later]
    width = Counter(map(len, half)).most_common(1)[0][0] if half else 0
    body = [row for row in half if len(row) == width]
    kinds = tuple(_kind(cells, decimal) for cells in zip(*body, strict=True))
    fitting = [_fits(row, kinds, decimal) for row in rows]
    if 'number' not in kinds or not any(fitting) or (width == 1) != (delimiter == ALONE):
        return None
    if delimiter == decimal and not any(decimal in cell for row in body for cell in row):
        return None  # it separates cells, and stands in none
    first = fitting.index(True)
    if sum(fitting[first:]) < _ENOUGH * (len(fitting) - first):
        return None
    return Dialect(delimiter, decimal, kinds, lines[first][0], tuple(rows[first:]) + tuple(body))


def _number_kind(cell: str, decimal: str) -> str:
    """Return the kind of a cell, signs between thousands allowed, so that these are refused as such."""
    kind = kind_of(cell, decimal)
    return 'number' if kind == 'thousands' else kind


def _kind(cells: Sequence[str], decimal: str) -> str:
    """Return what most cells of a column are, those without a value aside."""
    kinds = Counter(_number_kind(cell, decimal) for cell in cells)
    kinds.pop('missing', None)
    return kinds.most_common(1)[0][0] if kinds else 'missing'


def _fits(row: Sequence[str], kinds: Sequence[str], decimal: str) -> bool:
    if len(row) != len(kinds):
        return False
    pairs = zip(row, kinds, strict=True)
    own = [(_number_kind(cell, decimal), kind) for cell, kind in pairs if kind != 'text']
    return all(one in (kind, 'missing') for one, kind in own) and any(one == kind for one, kind in own)


def _same(one: Dialect, other: Dialect) -> bool:
    """Return whether two ways give the same columns with the same numbers."""
    if one.kinds != other.kinds or one.rows != other.rows:
        return False
    cells = {cell for row in one.rows for cell, kind in zip(row, one.kinds, strict=False) if kind == 'number'}
    return all(kind_of(cell, one.decimal) == kind_of(cell, other.decimal) for cell in cells)


def _fits_titles(dialect: Dialect, lines: Lines) -> bool:
    """Return whether the line above the samples has the same width, and all its cells are words."""
    above = [text for number, text in lines if number < dialect.first]
    if not above:
        return False
    if dialect.delimiter == ALONE:
        return not any(sign in above[-1] for sign in ';\t,|')
    cells = cells_of(above[-1], dialect.delimiter)
    kinds = {kind_of(cell, dialect.decimal) for cell in cells}
    return len(cells) == len(dialect.kinds) and 'number' not in kinds


def _refuse_thousands(path: Path, dialect: Dialect) -> None:
    """Raise `SignalError` where every decimal sign may group thousands: three digits follow each.

    A point is doubted only beside semicolons (chosen): where these stand, the decimal sign is a comma.
    """
    if dialect.decimal == '.' and dialect.delimiter != ';':
        return
    sign, width = dialect.decimal, len(dialect.kinds)
    for place, kind in enumerate(dialect.kinds):
        cells = [row[place] for row in dialect.rows if len(row) == width]
        signed = [cell for cell in cells if sign in cell]
        if kind == 'number' and len(signed) != len(cells) and signed and all(map(_GROUPED.fullmatch, signed)):
            cell = signed[0]
            raise SignalError(
                f'{path}: column {place} holds {cell!r} beside whole numbers, which may be '
                f'{cell.replace(sign, ",."[sign == ","])} or {cell.replace(sign, "")}; state it with '
                '--decimal, or export without signs between thousands'
            )
