"""How a text table is read: encoding, delimiter, decimal sign, names, units, first line of the samples."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.headers import in_unit_row, is_unit, name_and_unit
from engine_mount.signals.formats.measured import Heading, unique
from engine_mount.signals.formats.text.cells import ALONE, BLANK, COMMENTS, Decimal, Kind, is_comment, kind_of
from engine_mount.signals.formats.text.lines import Encoding, encoding_of, sample
from engine_mount.signals.formats.text.splitting import Split, split_of
from engine_mount.signals.signal import SignalError

_GAPS = re.compile(r'\t+|\s{2,}')


@dataclass(frozen=True)
class Dialect:
    """What is known of a text table before its samples are read; `first` is their first line, from 1 on."""

    encoding: Encoding
    delimiter: str
    decimal: Decimal
    kinds: tuple[Kind, ...]
    first: int
    headings: tuple[Heading, ...]
    notes: tuple[str, ...]


def dialect_of(path: Path, stated: Stated) -> Dialect:
    """Return the dialect of a text table, or raise `SignalError`."""
    encoding = encoding_of(path)
    head, others = sample(path, encoding)
    split = split_of(path, head, others, stated)
    above = [(number, text) for number, text in enumerate(head[: split.first - 1], 1) if text.strip()]
    names, units, first, notes = _titles(path, split, above)
    last = _behind_trailing_delimiter(split, names)
    names, units = names[:last], units[:last] if units else []
    headings = []
    for place, title in enumerate(names):
        name, unit = name_and_unit(title)
        told = units[place].strip().strip('[]').strip() if units else ''
        told = told[1:-1] if told[:1] + told[-1:] == '()' else told
        date = split.kinds[place] == 'date'
        headings.append(Heading(name, title, 's' if date else told or unit, place, date=date))
    notes.insert(0, f'read as {split.told}, {encoding.codec}')
    return Dialect(
        encoding, split.delimiter, split.decimal, split.kinds, first, tuple(unique(headings)), tuple(notes)
    )


def _titles(
    path: Path, split: Split, above: Sequence[tuple[int, str]]
) -> tuple[list[str], list[str], int, list[str]]:
    """Return names, units or [], the first line of the samples, and notes."""
    plain = [(number, split.cells(text)) for number, text in above if not is_comment(text)]
    lines = dict(above)
    found = [(number, _as_wide(cells, lines[number], split)) for number, cells in plain]
    last = found[-1][1] if found else None
    if last is not None and len(found) > 1 and found[-2][1] is not None and _is_unit_row(last, split):
        return found[-2][1] or [], last, split.first, _left_out(plain[:-2])
    if last is not None:
        return last, [], split.first, _left_out(plain[:-1])
    if plain and plain[-1][0] >= split.first - 1:
        _refuse_other_width(path, split, *plain[-1])
    commented = [_commented(text, split) for _, text in above if is_comment(text)]
    if commented and commented[-1]:
        return commented[-1], [], split.first, _left_out(plain)
    if _is_numbered(split):
        numbered = [cell or 'index' for cell in split.rows[0]]
        return numbered, [], split.first + 1, ['the first line is taken as numbers of the columns']
    names = [str(place) for place in range(split.width)]
    if split.kinds[-1] == 'missing':
        names[-1] = ''
    return names, [], split.first, [*_left_out(plain), 'no titles: the columns are numbered from 0 on']


def _as_wide(cells: list[str], text: str, split: Split) -> list[str] | None:
    """Return cells of a line above as titles, None where they are not as many as the columns."""
    if split.delimiter == BLANK and len(cells) != split.width:
        cells = _GAPS.split(text.strip())
    if split.delimiter == ALONE:
        cells = [text.strip().strip('"')]
    while len(cells) > split.width and not cells[-1]:
        cells = cells[:-1]
    if len(cells) == split.width - 1 and split.kinds[-1] == 'missing':
        cells = [*cells, '']
    if len(cells) != split.width or not any(cells):
        return None
    return None if all(kind_of(cell, split.decimal) in ('number', 'missing') for cell in cells) else cells


def _is_unit_row(cells: list[str], split: Split) -> bool:
    told = [cell for cell in cells if cell]
    return all(map(in_unit_row, cells)) and any(is_unit(cell.strip('[]()')) for cell in told)


def _commented(text: str, split: Split) -> list[str]:
    """Return the titles that a comment holds, [] where it holds none."""
    bare = text.strip()
    for sign in COMMENTS:
        bare = bare.removeprefix(sign)
    bare = bare.lstrip('#%/').strip()
    ways = (split.cells(bare), _GAPS.split(bare), [cell.strip() for cell in bare.split(',')], bare.split())
    fitting = (cells for cells in ways if len(cells) == split.width and all(cells))
    return next((cells for cells in fitting if not all(_is_number(cell) for cell in cells)), [])


def _is_number(cell: str) -> bool:
    return kind_of(cell, '.') == 'number' or kind_of(cell, ',') == 'number'


def _is_numbered(split: Split) -> bool:
    """Whether the first line counts the columns, as an export of a frame without names does."""
    cells = split.rows[0]
    counted = [cell for cell in cells if cell]
    numbers = [str(place) for place in range(len(counted))]
    fractions = sum(split.decimal in cell for row in split.rows[1:] for cell in row)
    return len(counted) > 1 and counted == numbers and fractions >= 0.5 * len(split.rows[1:])


def _refuse_other_width(path: Path, split: Split, number: int, cells: list[str]) -> None:
    """Raise `SignalError` where the line just above the samples looks like titles of other columns."""
    words = [cell for cell in cells if cell and not _is_number(cell)]
    if len(cells) > 1 and len(words) == len(cells) and split.width > 1:
        raise SignalError(
            f'{path}, line {number}: {len(cells)} titles ({", ".join(cells)[:80]}) above lines of '
            f'{split.width} cells ({", ".join(split.rows[0])[:80]}); is a decimal comma among commas? Export '
            'with semicolons, or with one title for each column'
        )


def _left_out(rows: Sequence[tuple[int, list[str]]]) -> list[str]:
    if not rows:
        return []
    first = ' '.join(rows[0][1])[:60]
    return [f'{len(rows)} lines before the titles are left out, the first {first!r}']


def _behind_trailing_delimiter(split: Split, names: list[str]) -> int:
    """Return how many columns there are but for an empty one behind a trailing delimiter."""
    return len(names) - (not names[-1] and split.kinds[-1] == 'missing' and len(names) > 1)
