"""Which delimiter and decimal sign a text table has: those under which its lines are a table of numbers.

Every pair of the two is tried. Those under which the lines have equal widths and each column holds one kind
of cells are possible; of these the ones with the fewest columns of text stay. Where more than one is left and
they differ, the titles decide; where these do not either, the table is refused.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.text.cells import ALONE, BLANK, Decimal, Kind, cells_of, is_comment, kind_of
from engine_mount.signals.signal import SignalError

_DELIMITERS = (';', '\t', ',', '|', BLANK, ALONE)
_NAMES = {
    ';': 'semicolon', '\t': 'tab', ',': 'comma', '|': 'stroke', BLANK: 'blanks', ALONE: 'one column',
}  # fmt: skip
_STATED = {name: sign for sign, name in _NAMES.items()} | {'blank': BLANK, '\\t': '\t', ' ': BLANK}
_MOST = 2000  # lines that are looked at, chosen
_ENOUGH = 0.5  # of the lines behind the first that fits, chosen: fewer are no table


@dataclass(frozen=True)
class Line:
    """A line of the file with its number from 1 on."""

    number: int
    text: str


@dataclass(frozen=True)
class Split:
    """One way to read the lines: the kinds of the columns, and which line is the first of the samples."""

    delimiter: str
    decimal: Decimal
    kinds: tuple[Kind, ...]
    first: int
    rows: tuple[tuple[str, ...], ...]

    @property
    def width(self) -> int:
        """How many cells a line has."""
        return len(self.kinds)

    @property
    def told(self) -> str:
        """The dialect in words."""
        return f'{delimiter_name(self.delimiter)}, decimal {"point" if self.decimal == "." else "comma"}'

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line."""
        return cells_of(line, self.delimiter)

    @property
    def shared(self) -> float:
        """Share of columns that hold no text."""
        return sum(kind != 'text' for kind in self.kinds) / self.width


def delimiter_name(delimiter: str) -> str:
    """Return what a person calls it."""
    return _NAMES.get(delimiter, repr(delimiter))


def split_of(path: Path, head: Sequence[str], others: Sequence[str], stated: Stated) -> Split:
    """Return how to read the lines at the beginning, `head`, and `others` behind; raises `SignalError`."""
    lines = [Line(number, text) for number, text in enumerate(head, 1) if text.strip()]
    lines = [line for line in lines if not is_comment(line.text)]
    later = [text for text in others if text.strip() and not is_comment(text)]
    possible = _best([
        split
        for delimiter in _delimiters(stated)
        for decimal in _decimals(delimiter, stated)
        if (split := _split(lines, later, delimiter, decimal)) is not None
    ])  # fmt: skip
    if not possible:
        raise SignalError(_no_table(path, lines))
    if len(possible) > 1:
        possible = [split for split in possible if _bears_out(split, lines)] or possible
    if len(possible) > 1:
        raise SignalError(_ambiguous(path, possible))
    _refuse_thousands(path, possible[0], stated)
    return possible[0]


def _delimiters(stated: Stated) -> tuple[str, ...]:
    return (_STATED.get(stated.delimiter, stated.delimiter),) if stated.delimiter else _DELIMITERS


def _decimals(delimiter: str, stated: Stated) -> tuple[Decimal, ...]:
    if stated.decimal:
        return (',',) if stated.decimal == ',' else ('.',)
    return ('.', ',')


def _split(lines: list[Line], later: list[str], delimiter: str, decimal: Decimal) -> Split | None:
    """Return the table that lines are under a delimiter and a decimal sign, None where they are none."""
    rows = [tuple(cells_of(line.text, delimiter)) for line in lines[:_MOST]]
    half = rows[len(rows) // 2 :]
    width = Counter(map(len, half)).most_common(1)[0][0] if half else 0
    body = [row for row in half if len(row) == width]
    body += [row for row in (tuple(cells_of(text, delimiter)) for text in later) if len(row) == width]
    kinds = tuple(_kind([row[place] for row in body], decimal) for place in range(width))
    fitting = [_fits(row, kinds, decimal) for row in rows]
    if 'number' not in kinds or not any(fitting) or (width == 1) != (delimiter == ALONE):
        return None
    if delimiter == decimal and not any(decimal in cell for row in body for cell in row):
        return None  # it separates cells, and stands in none
    first = fitting.index(True)
    if sum(fitting[first:]) < _ENOUGH * (len(fitting) - first):
        return None
    return Split(delimiter, decimal, kinds, lines[first].number, tuple(rows[first:]) + tuple(body))


def _kind(cells: list[str], decimal: Decimal) -> Kind:
    """Return what most cells of a column are, those without a value aside."""
    kinds = Counter(kind_of(cell, decimal) for cell in cells)
    kinds.pop('missing', None)
    return kinds.most_common(1)[0][0] if kinds else 'missing'


def _fits(row: Sequence[str], kinds: Sequence[Kind], decimal: Decimal) -> bool:
    if len(row) != len(kinds):
        return False
    found = [kind_of(cell, decimal) for cell in row]
    pairs = [(one, kind) for one, kind in zip(found, kinds, strict=True) if kind != 'text']
    return all(one in (kind, 'missing') for one, kind in pairs) and any(one == kind for one, kind in pairs)


def _best(possible: list[Split]) -> list[Split]:
    """Return those with the fewest columns of text, each table once."""
    most = max((split.shared for split in possible), default=0.0)
    found: list[Split] = []
    for split in possible:
        same = any(_same(split, other) for other in found)
        if split.shared == most and not same:
            found.append(split)
    return found


def _same(one: Split, other: Split) -> bool:
    """Whether two ways give the same numbers: no number needs the decimal sign, or the cells are equal."""
    if one.rows != other.rows or one.kinds != other.kinds:
        return False
    return one.decimal == other.decimal or not any(
        one.decimal in cell or other.decimal in cell
        for row in one.rows
        for cell, kind in zip(row, one.kinds, strict=False)
        if kind == 'number'
    )


def _bears_out(split: Split, lines: list[Line]) -> bool:
    """Whether the line of titles has the same width, and all its cells are words."""
    above = [line for line in lines if line.number < split.first]
    if not above:
        return False
    if split.delimiter == ALONE:
        return not any(sign in above[-1].text for sign in _DELIMITERS[:4])
    cells = split.cells(above[-1].text)
    return len(cells) == split.width and all(kind_of(cell, split.decimal) != 'number' for cell in cells)


def _refuse_thousands(path: Path, split: Split, stated: Stated) -> None:
    """Raise `SignalError` where every decimal sign may group thousands: three digits follow each.

    A point is doubted only beside semicolons (chosen): where these stand, the decimal sign is a comma.
    """
    if stated.decimal or (split.decimal == '.' and split.delimiter != ';'):
        return
    for place, kind in enumerate(split.kinds):
        cells = [row[place] for row in split.rows if len(row) == split.width]
        signed = [cell for cell in cells if split.decimal in cell]
        if kind == 'number' and len(signed) != len(cells) and signed and all(map(_grouped, signed)):
            other = '.' if split.decimal == ',' else ','
            raise SignalError(
                f'{path}: column {place} holds {signed[0]!r} beside whole numbers, which may be '
                f'{signed[0].replace(split.decimal, other)} or {signed[0].replace(split.decimal, "")}; state '
                f'it with --decimal, or export without signs between thousands'
            )


def _grouped(cell: str) -> bool:
    head, _, tail = cell.lstrip('+-').replace(',', '.').partition('.')
    return len(tail) == 3 and tail.isdecimal() and 1 <= len(head) <= 3 and not head.startswith('0')


def _no_table(path: Path, lines: list[Line]) -> str:
    if not lines:
        return f'{path} holds comments and blank lines only; needed are lines of numbers'
    line = lines[len(lines) // 2]
    return (
        f'{path}, line {line.number}: {line.text.strip()[:80]!r} is no line of a table of numbers; expected '
        'are lines of equally many cells between semicolons, tabs, commas or blanks, decimal point or comma, '
        'no signs between thousands'
    )


def _ambiguous(path: Path, possible: list[Split]) -> str:
    ways = ' or '.join(
        f'{split.told} ({", ".join(split.rows[0][:4]).replace(chr(9), " ")})' for split in possible
    )
    return f'{path} can be read as {ways}; state --decimal or --delimiter, or export with semicolons'
