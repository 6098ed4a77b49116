"""The units of what is measured at an engine mount, by every common spelling.

A table of its own rather than a library of all units: there `g` is the gram, `lb` a mass and `mS` a
conductance, so columns of this field would be read wrong without a word. Spelling is case-sensitive (`mS` is
not `ms`), but that of words of three letters or more is not (`Sec`). Factors are exact by definition (ISO
80000-3 and -4, NIST SP 811), standard gravity 9.80665 m/s^2 (3rd CGPM, 1901) among them.
"""

import difflib
import re
from typing import NamedTuple

from engine_mount.signals.signal import FloatArray, SignalError

STANDARD_GRAVITY = 9.80665
"""m/s^2, exact by definition (3rd CGPM, 1901)."""
ZERO_CELSIUS = 273.15
"""K, exact by definition."""
_INCH = 0.0254  # m, exact
_FOOT = 0.3048  # m, exact
_MILE = 1609.344  # m, exact
_POUND_FORCE = 0.45359237 * STANDARD_GRAVITY  # N, exact
_PSI = _POUND_FORCE / (_INCH * _INCH)  # Pa, exact
_TURN = 6.283185307179586  # rad
_WORD = 3  # letters, chosen: shorter spellings differ by case alone (mS and ms, MN and mN)


class Unit(NamedTuple):
    """A unit: one of it is `factor` of the SI unit of its `dimension`, its zero lies at `zero` of that."""

    symbol: str
    dimension: str
    factor: float
    zero: float = 0.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """Return `values` (n,) of this unit in SI."""
        return values * self.factor + self.zero if self.zero else values * self.factor


_UNITS_OF: dict[str, dict[str, float]] = {
    'length': {
        'mm millimetre millimeter': 1e-3,
        'um micron microns micrometre micrometer': 1e-6,
        'm metre meter metres meters': 1.0,
        'in inch inches " zoll': _INCH,
        'cm centimetre centimeter': 1e-2,
        'nm': 1e-9,
        'km': 1e3,
        'mil thou': 1e-3 * _INCH,
        "ft foot feet '": _FOOT,
    },
    'velocity': {
        'm/s mps': 1.0,
        'mm/s': 1e-3,
        'um/s': 1e-6,
        'cm/s': 1e-2,
        'km/h kmh kph km/hr': 1.0 / 3.6,
        'mph mi/h': _MILE / 3600.0,
        'in/s ips in/sec': _INCH,
        'ft/s fps ft/sec': _FOOT,
    },
    'acceleration': {
        'm/s^2 m/s2 m/s/s mps2 m/sec^2 m/sec2 m*s-2 ms^-2 ms-2': 1.0,
        'g g_n gn g0 g_0 G': STANDARD_GRAVITY,
        'mg milli-g': 1e-3 * STANDARD_GRAVITY,
        'mm/s^2 mm/s2': 1e-3,
        'cm/s^2 cm/s2 gal': 1e-2,
        'ug': 1e-6 * STANDARD_GRAVITY,
        'ft/s^2 ft/s2': _FOOT,
        'in/s^2 in/s2': _INCH,
    },
    'force': {
        'N newton newtons': 1.0,
        'kN': 1e3,
        'mN': 1e-3,
        'MN': 1e6,
        'daN': 10.0,
        'lbf lb lbs lb_f pound pounds': _POUND_FORCE,
        'kip kips klbf': 1e3 * _POUND_FORCE,
        'kgf kp': STANDARD_GRAVITY,
    },
    'current': {'A amp amps ampere': 1.0, 'mA': 1e-3, 'uA': 1e-6, 'kA': 1e3},
    'voltage': {'V volt volts': 1.0, 'mV': 1e-3, 'uV': 1e-6},
    'time': {
        's sec secs second seconds sek sekunde sekunden': 1.0,
        'ms msec millisecond milliseconds millisekunden': 1e-3,
        'us usec microsecond microseconds': 1e-6,
        'ns nsec nanosecond nanoseconds': 1e-9,
        'min minute minutes minuten': 60.0,
        'h hour hours': 3600.0,
    },
    'temperature': {'degC celsius C grdC gradC': 1.0, 'K kelvin': 1.0, 'degF fahrenheit F': 5.0 / 9.0},
    'pressure': {
        'Pa pascal': 1.0,
        'hPa mbar': 100.0,
        'kPa': 1e3,
        'MPa N/mm^2': 1e6,
        'bar': 1e5,
        'psi lbf/in^2': _PSI,
        'ksi': 1e3 * _PSI,
    },
    'current/time': {'A/s': 1.0, 'A/ms': 1e3, 'mA/s': 1e-3, 'mA/ms': 1.0},
    'inductance': {'H henry': 1.0, 'mH': 1e-3, 'uH': 1e-6, 'nH': 1e-9},
    'flux density/time': {'T/s': 1.0, 'T/ms': 1e3, 'mT/s': 1e-3, 'mT/ms': 1.0},
    'flux density': {'T tesla Vs/m^2': 1.0, 'mT': 1e-3, 'uT': 1e-6},
    'resistance': {'Ohm Ω': 1.0, 'mOhm mΩ': 1e-3, 'kOhm kΩ': 1e3},
    'frequency': {'Hz 1/s': 1.0, 'kHz': 1e3},
    'angle': {'rad': 1.0, 'deg degree degrees grad': _TURN / 360.0},
    'angular velocity': {
        'rad/s': 1.0,
        'deg/s': _TURN / 360.0,
        'rpm 1/min U/min': _TURN / 60.0,
    },
    'ratio': {'1 -': 1.0, '%': 1e-2},
}
_ZEROS = {'degC': ZERO_CELSIUS, 'degF': ZERO_CELSIUS - 32.0 * 5.0 / 9.0}  # K
_SIGNS = str.maketrans({'µ': 'u', 'μ': 'u', '²': '^2', '·': '*', '⋅': '*', '°': 'deg', '″': '"', 'Ω': 'Ω'})
_PRODUCT = re.compile(r' *[* ] *([a-z]+)\^-(\d)')  # m s^-2 is m/s^2
_TRAPS = {
    'S': 'S is siemens; for seconds write s',
    'mS': 'mS is millisiemens; for milliseconds write ms',
    'uS': 'uS is microsiemens; for microseconds write us',
    'M': 'M is mega alone; for metres write m, for minutes min',
    'KN': 'KN is no unit; for kilonewtons write kN',
}
_UNITS = {
    spelling: Unit(spellings.split()[0], dimension, factor, _ZEROS.get(spellings.split()[0], 0.0))
    for dimension, rows in _UNITS_OF.items()
    for spellings, factor in rows.items()
    for spelling in spellings.split()
}
_WORDS = {
    name: unit
    for name, unit in _UNITS.items()
    if len(name) >= _WORD and name.islower() and name.isalpha() and name[1:] not in _UNITS
}
"""Those that mean the same in capitals: not `msec` nor `mbar`, of which M would be mega."""


def unit_of(text: str, dimension: str = '') -> Unit:
    """Return the unit that `text` spells, see `find_unit`; raises `SignalError`."""
    unit = find_unit(text, dimension)
    if unit is None:
        plain = _plain(text)
        near = [symbol for symbol in _UNITS if symbol.lower() == plain.lower()]
        near = near or difflib.get_close_matches(plain, _UNITS, n=3, cutoff=0.6)
        known = f'known are {", ".join(dict.fromkeys(one.symbol for one in _UNITS.values()))}'
        guess = _TRAPS.get(plain) or (f'is it {" or ".join(near)}?' if near else known)
        raise SignalError(f'unit {text!r} is not known: {guess}')
    return unit


def find_unit(text: str, dimension: str = '') -> Unit | None:
    """Return the unit that `text` spells, such as `m/s²`, `[mm]` or `lbf`; None where it is not known.

    Of a known `dimension` small letters will do, as headers write them (`_mh`, `_n`, `a_per_s`), unless two
    units differ by capitals alone.
    """
    plain = _plain(text)
    unit = _UNITS.get(plain) or _WORDS.get(plain.lower())
    if dimension and (unit is None or unit.dimension != dimension):
        small = plain.replace('_per_', '/')
        fitting = {
            one for name, one in _UNITS.items() if one.dimension == dimension and name.lower() == small
        }
        if len(fitting) == 1 and not min(one.symbol for one in fitting).startswith('M'):
            return fitting.pop()
    return unit


def is_unit(text: str, dimension: str = '') -> bool:
    """Return whether `text` spells a known unit, of `dimension` where one is named."""
    unit = find_unit(text, dimension)
    return unit is not None and dimension in ('', unit.dimension)


def si_unit(dimension: str) -> Unit:
    """Return the SI unit of a dimension."""
    return next(unit for unit in units_of(dimension) if unit.factor == 1.0 and unit.zero == 0.0)


def units_of(dimension: str) -> tuple[Unit, ...]:
    """Return the units of a dimension, the likeliest at an engine mount first."""
    return tuple(dict.fromkeys(unit for unit in _UNITS.values() if unit.dimension == dimension))


def _plain(text: str) -> str:
    text = text.strip().strip('[](){}').replace('**', '^').translate(_SIGNS)
    quotient = _PRODUCT.sub(r'/\1^\2', text).replace('^1', '')
    return quotient if quotient in _UNITS else text.replace(' ', '')
