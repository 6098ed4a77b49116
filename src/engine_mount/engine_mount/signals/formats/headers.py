"""Names and units out of titles of columns: `Weg [mm]`, `Weg (mm)`, `accel_z/g`, `disp_mm`, `Kraft in N`."""

import re
from collections.abc import Sequence

from engine_mount.signals.units import is_unit as is_convertible

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
