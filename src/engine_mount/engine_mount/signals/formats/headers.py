"""Names and units out of titles of columns: `Weg [mm]`, `Weg (mm)`, `accel_z/g`, `disp_mm`, `Kraft in N`."""

import re

_SYMBOLS = {
    's', 'ms', 'us', 'µs', 'μs', 'ns', 'min', 'h',
    'm', 'mm', 'um', 'µm', 'μm', 'nm', 'cm', 'km', 'in', 'inch', 'ft', 'mil',
    'N', 'kN', 'mN', 'MN', 'lb', 'lbf', 'kip', 'kips', 'kgf', 'Nm',
    'g', 'mg', 'G', 'kg', 't',
    'A', 'mA', 'V', 'mV', 'kV', 'T', 'mT', 'Wb', 'H', 'mH', 'uH', 'µH', 'Ohm', 'ohm', 'Ω', 'W', 'kW', 'J',
    'Hz', 'kHz', 'MHz', 'rpm', 'U', 'deg', 'degree', 'degrees', '°', 'rad', 'mrad',
    'K', 'degC', '°C', 'C', '°F', 'degF', '%', '-',
    'Pa', 'kPa', 'MPa', 'GPa', 'hPa', 'bar', 'mbar', 'psi',
    'kmh', 'kph', 'mph', 'mps', 'knots',
}  # fmt: skip
"""What counts as a unit where a title does not bracket it: SI with its prefixes, and those of rigs."""
_SUFFIXES = {
    's', 'ms', 'us', 'ns', 'm', 'mm', 'um', 'cm', 'km', 'in', 'inch', 'ft', 'N', 'kn', 'kN',
    'lb', 'lbf', 'kip', 'g', 'mg', 'kg', 'A', 'ma', 'mA', 'V', 'mv', 'mV', 'T', 'mt', 'mT', 'H', 'mh', 'mH',
    'hz', 'Hz', 'khz', 'kHz', 'deg', 'rad', 'K', 'C', 'degc', 'degC', 'pa', 'Pa', 'kpa', 'kPa', 'mpa', 'MPa',
    'bar', 'psi', 'kmh', 'kph', 'mph', 'rpm', 'nm', 'Nm',
}  # fmt: skip
"""What counts as a unit behind an underscore; of single small letters those that name no axis or phase."""
_WRITTEN = {'m_s2': 'm/s2', 'mps2': 'm/s2', 'ms2': 'm/s2', 'm_s': 'm/s', 'mps': 'm/s', 'km_h': 'km/h'}
"""Suffixes that leave out the stroke of a fraction."""
_POWER = r'(?:\^?-?\d|\*\*-?\d|[²³])?'
_TERM = rf'\(?(?:1|[^\W\d_²³]+|°[CF]?|%|-){_POWER}\)?'
_UNIT = re.compile(rf'\(?{_TERM}(?:\s*[/*·. ]\s*{_TERM})*\)?')
_WORD = re.compile(r'°[CF]?|[^\W\d_²³]+|%|-')
_SQUARE = re.compile(r'(.*?)\s*\[\s*([^\[\]]*?)\s*\]\s*')
_ROUND = re.compile(r'(.*?)\s*[({]\s*(.*?)\s*[)}]\s*')
_STROKE = re.compile(r'([^/]+?)\s*/\s*(.+?)\s*')
_WORDS = re.compile(r'(.+?)(?:\s+in\s+|\s*,\s+)(\S+)\s*')
_SUFFIX = re.compile(r'(.+?)_((?:m_s2|m_s|km_h|mps2|mps|ms2)|[A-Za-z]+(?:_per_[A-Za-z]+[23]?)?)')


def name_and_unit(title: str) -> tuple[str, str]:
    """Return the name and the unit that a title tells, the unit '' where it tells none."""
    title = title.strip()
    square = _SQUARE.fullmatch(title)
    if square and square[1] and not square[2].isdecimal():  # [0] is a place, not a unit
        return square[1], square[2]
    if is_unit(title):
        return title, ''
    for pattern in (_ROUND, _STROKE, _WORDS):
        match = pattern.fullmatch(title)
        if match and match[1] and is_unit(match[2]):
            return match[1].rstrip(' /'), match[2].strip('()') if pattern is _STROKE else match[2]
    match = _SUFFIX.fullmatch(title)
    if match and match[2] in _WRITTEN:
        return match[1], _WRITTEN[match[2]]
    if match and all(part.rstrip('23') in _SUFFIXES for part in match[2].split('_per_')):
        return match[1], match[2].replace('_per_', '/')
    return title, ''


def is_unit(text: str) -> bool:
    """Return whether a text can be nothing but a unit, such as `m/s^2`, `mm` or `1/min`."""
    text = text.strip()
    if not text or text == '1' or text.count('(') != text.count(')') or not _UNIT.fullmatch(text):
        return False
    return all(word in _SYMBOLS for word in _WORD.findall(text))


def in_unit_row(text: str) -> bool:
    """Return whether a cell may stand in a row of units: a unit, one in brackets, or nothing."""
    text = text.strip()
    return not text or is_unit(text) or (text[0] + text[-1]) in ('[]', '()')
