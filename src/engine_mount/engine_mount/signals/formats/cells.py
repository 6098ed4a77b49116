"""Cells of a table of text or of a spreadsheet: numbers, titles with their units."""

import csv
import re
from collections.abc import Sequence
from datetime import UTC, datetime

from engine_mount.signals.units import is_unit as is_convertible

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
_CLOCK = (
    r'(?P<hour>\d\d?):(?P<minute>\d\d)(?::(?P<second>\d\d))?(?:[.,](?P<fraction>\d{1,9}))?'
    r'(?: ?(?P<half>[AP])M)?(?P<zone>Z|[+-]\d\d:?\d\d)?'
)
_DATES = tuple(
    re.compile(day + _CLOCK)
    for day in (
        r'(?P<year>\d{4})[-/](?P<month>\d\d?)[-/](?P<day>\d\d?)[T ]',
        r'(?P<day>\d\d?)\.(?P<month>\d\d?)\.(?P<year>\d{4})[T ]',
        r'(?P<day>1[3-9]|[23]\d)/(?P<month>\d\d?)/(?P<year>\d{4}) ',
        r'(?P<month>\d\d?)/(?P<day>\d\d?)/(?P<year>\d{4}) ',
        r'(?=\d+:\d+:)',
    )
)
"""ISO 8601, `24.11.2026 10:00:00,5`, `24/11/2026 10:00`, `11/24/2026 10:00:00 AM`, and times of day."""
_FIRST = {'year': '1970', 'month': '1', 'day': '1', 'second': '0', 'fraction': '', 'half': '', 'zone': ''}


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
    return 'date' if any(date.fullmatch(cell) for date in _DATES) else 'text'


def number_in(cell: str, decimal: str) -> float:
    """Return the number in a cell, NaN where none is written; raises `ValueError` for anything else."""
    if cell in _MISSING:
        return float('nan')
    if not _NUMBERS[decimal].fullmatch(cell):
        raise ValueError(cell)
    return float(cell.replace(',', '.'))


def date_in(cell: str) -> int:
    """Return a date in ns since 1970, without a zone taken as UTC; raises `ValueError`.

    A time of day is one of 1970-01-01. Of dates with strokes the month is first, unless it exceeds 12.
    """
    match = next((match for date in _DATES if (match := date.fullmatch(cell))), None)
    if not match:
        raise ValueError(cell)
    part = _FIRST | {name: text for name, text in match.groupdict().items() if text}
    hour = int(part['hour']) % 12 + 12 * (part['half'] == 'P') if part['half'] else part['hour']
    moment = datetime.fromisoformat(
        '{year}-{month:0>2}-{day:0>2}T{0:0>2}:{minute}:{second:0>2}{zone}'.format(hour, **part)
    )
    seconds = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    return round(seconds) * 1_000_000_000 + int(part['fraction'].ljust(9, '0'))


_OTHERS = (
    'kg', 't', 'Nm', 'kNm', 'W', 'kW', 'J', 'Wb', 'kV', 'MHz', 'GPa', 'mrad', 'G', 'knots',
)  # fmt: skip
"""Units of columns that are never converted, so that a row of units is known as one."""
_NO_SUFFIXES = ('min', 'h', 'F', 'c', 'mil', 'gal')
"""What behind an underscore is rather a minimum, an axis or a name."""
_POWER = r'(?:\^?-?\d|\*\*-?\d|[²³])?'
_TERM = rf'\(?(?:1|[^\W\d_²³]+|°[CF]?|%|-){_POWER}\)?'
_UNIT = re.compile(rf'\(?{_TERM}(?:\s*[/*·. ]\s*{_TERM})*\)?')
_WORD = re.compile(r'°[CF]?|[^\W\d_²³]+|%|-')
_SQUARE = re.compile(r'(.*?)\s*\[\s*([^\[\]]*?)\s*\]\s*')
_PATTERNS = tuple(
    map(
        re.compile,
        (r'(.*?)\s*[({]\s*(.*?)\s*[)}]\s*', r'([^/]+?)\s*/\s*(.+?)\s*', r'(.+?)(?:\s+in\s+|\s*,\s+)(\S+)\s*'),
    )
)
"""`Weg (mm)`, `accel_z/g`, `Kraft in N` or `Time, s`."""


def name_and_unit(title: str) -> tuple[str, str]:
    """Return the name and the unit that a title tells, the unit '' where it tells none."""
    title = title.strip()
    square = _SQUARE.fullmatch(title)
    if square and square[1] and not square[2].isdecimal():  # [0] is a place, not a unit
        return square[1], square[2]
    if is_unit(title):
        return title, ''
    for pattern in _PATTERNS:
        match = pattern.fullmatch(title)
        if match and match[1] and is_unit(match[2]):
            return match[1].rstrip(' /'), match[2].strip('()')
    parts = title.split('_')
    for count in (3, 2, 1):  # v_in_per_s, acc_m_s2, disp_mm
        unit = '/'.join(part for part in parts[-count:] if part != 'per')
        if len(parts) > count and unit not in _NO_SUFFIXES and is_convertible(unit) and not unit.isdecimal():
            return '_'.join(parts[:-count]), unit
    return title, ''


def is_unit(text: str) -> bool:
    """Return whether a text can be nothing but a unit, such as `m/s^2`, `mm`, `N/mm` or `1/min`."""
    text = text.strip()
    if text in ('', '1') or text.count('(') != text.count(')') or not _UNIT.fullmatch(text):
        return False
    return all(word in _OTHERS or is_convertible(word) for word in _WORD.findall(text))


def is_unit_row(cells: Sequence[str]) -> bool:
    """Return whether a row below titles tells units: each cell a unit, one in brackets, or nothing."""
    return all(
        not cell or is_unit(cell) or cell[0] + cell[-1] in ('[]', '()') for cell in map(str.strip, cells)
    ) and any(is_unit(cell.strip(' []()')) for cell in cells)


def titles_and_units(titles: Sequence[str], units: Sequence[str]) -> list[tuple[str, str, str]]:
    """Return name, header and unit of each title; `units` is the row of units below, or empty."""
    found = []
    for place, title in enumerate(titles):
        name, unit = name_and_unit(title)
        below = units[place].strip(' []') if place < len(units) else ''
        below = below[1:-1] if below[:1] + below[-1:] == '()' else below
        found.append((name, title, below or unit))
    return found
