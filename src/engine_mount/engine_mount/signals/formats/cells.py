"""What a cell of a text can be: a number, a date, nothing, or text."""

import csv
import re
from datetime import UTC, datetime

BLANK = 'blank'
"""Any number of blanks between cells."""
ALONE = '\x1f'
"""Between the cells of a table of one column: a sign that no text holds."""
_WORDS = (
    'nan', '-nan', 'na', 'n/a', 'null', 'none', '#n/a', '#nv', '#na', '-', '--', '?', '1.#qnan', '-1.#ind',
)  # fmt: skip
MISSING = (
    '',
    'NaN',
    *dict.fromkeys(form(word) for word in _WORDS for form in (str.lower, str.upper, str.title)),
)
"""How a missing value is written."""
_MISSING = frozenset(MISSING)
_NUMBER = r'[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?)'
_NUMBERS = {
    '.': re.compile(_NUMBER, re.IGNORECASE),
    ',': re.compile(_NUMBER.replace(r'\.?\d*', r'(?:,\d+)?').replace(r'\.', ','), re.IGNORECASE),
}
_GROUPS = {
    '.': re.compile(r"[+-]?\d{1,3}(?:(?:[,' ]\d{3}){2,}|(?:[,' ]\d{3})+\.\d+)"),
    ',': re.compile(r"[+-]?\d{1,3}(?:(?:[.' ]\d{3}){2,}|(?:[.' ]\d{3})+,\d+)"),
}
"""Numbers with signs between thousands, which are told from others and refused."""
_DATE = re.compile(
    r'(?:\d{4}-\d\d-\d\d|(\d\d?)\.(\d\d?)\.(\d{4}))[T ]'
    r'(\d\d:\d\d(?::\d\d)?)(?:[.,](\d{1,9}))?(Z|[+-]\d\d:?\d\d)?'
)  # ISO 8601, or as in 24.11.2026 10:00:00,5


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without quotes and blanks round them."""
    if delimiter == BLANK:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]


def kind_of(cell: str, decimal: str) -> str:
    """Return `number`, `thousands`, `date`, `missing` or `text` for a cell with that decimal sign."""
    if cell in _MISSING:
        return 'missing'
    if _NUMBERS[decimal].fullmatch(cell):
        return 'number'
    if _GROUPS[decimal].fullmatch(cell):
        return 'thousands'
    return 'date' if _DATE.fullmatch(cell) else 'text'


def number_in(cell: str, decimal: str) -> float:
    """Return the number in a cell, NaN where none is written; raises `ValueError` for anything else."""
    if cell in _MISSING:
        return float('nan')
    if not _NUMBERS[decimal].fullmatch(cell):
        raise ValueError(cell)
    return float(cell.replace(',', '.'))


def date_in(cell: str) -> int:
    """Return a date in ns since 1970, without a zone taken as UTC; raises `ValueError`."""
    match = _DATE.fullmatch(cell)
    if not match:
        raise ValueError(cell)
    day, month, year, clock, fraction, zone = match.groups()
    date = f'{year}-{month:0>2}-{day:0>2}' if year else cell[:10]
    moment = datetime.fromisoformat(f'{date}T{clock}{zone or ""}')
    seconds = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    return round(seconds) * 1_000_000_000 + int((fraction or '').ljust(9, '0'))
