"""Whether values can be in a unit, and which unit they look like.

A guess is only ever named in a refusal or beside what was said; it never chooses.
"""

from dataclasses import dataclass

import numpy as np

from engine_mount.signals.signal import FloatArray
from engine_mount.signals.units.quantities import Quantity
from engine_mount.signals.units.unit import STANDARD_GRAVITY, Unit, unit_of, units_of
from mount_models.arithmetic.averages import mean

GRAVITY_WITHIN = 0.06
"""Share of standard gravity, chosen: a tilt of 20 degrees, or the error of a common sensor."""
LARGEST_MEAN = 1.6
"""Standard gravities, chosen: no accelerometer at rest shows more, whatever its error."""
SHAKEN = 50.0
"""m/s^2, chosen as in `engine_mount.signals.excitation`: no chassis is shaken more but in a crash."""
_USUAL = (0.5, 99.5)
"""Percentiles, chosen: what lies beyond may be faults, of which the command that takes the values tells."""
_LOOKED_AT = 100_000  # values, chosen: enough for percentiles
_ACCELERATIONS = ('m/s^2', 'g', 'mg', 'mm/s^2', 'cm/s^2', 'ft/s^2', 'in/s^2')
_LENGTHS = ('mm', 'um', 'm', 'in', 'cm')
_OTHERS = {
    'force': ('N', 'kN', 'lbf', 'kip'),
    'velocity': ('m/s', 'km/h', 'mph', 'mm/s'),
    'current': ('A', 'mA'),
    'voltage': ('V', 'mV'),
    'inductance': ('mH', 'uH', 'H'),
    'temperature': ('degC', 'K', 'degF'),
    'pressure': ('bar', 'psi', 'Pa', 'MPa', 'kPa'),
}


@dataclass(frozen=True)
class Size:
    """Mean, lowest and highest of values, in their own unit; `usual`: without what is rare, as faults."""

    mean: float
    low: float
    high: float
    usual: tuple[float, float]

    @property
    def range(self) -> float:
        """Peak to peak."""
        return self.high - self.low


def size_of(values: FloatArray) -> Size:
    """Return the size of values (n,), n >= 1, those that are no number left out."""
    missing = np.isnan(values)
    known = values[~missing] if missing.any() else values
    low, high = float(known.min()), float(known.max())
    # One that is all the same has that mean, which a sum would miss by its rounding.
    usual = np.percentile(known[:: max(1, known.size // _LOOKED_AT)], _USUAL)
    return Size(mean(known) if high > low else low, low, high, (float(usual[0]), float(usual[1])))


def scaled(size: Size, scale: float) -> Size:
    """Return the size of the same values times `scale`."""
    low, high = sorted((size.low * scale, size.high * scale))
    usual = sorted(value * scale for value in size.usual)
    return Size(size.mean * scale, low, high, (usual[0], usual[1]))


def gravity_unit(size: Size) -> str:
    """Return the unit of acceleration in which the mean is that of gravity, '' where it is in none."""
    for symbol in _ACCELERATIONS:
        if abs(abs(size.mean) * unit_of(symbol).factor / STANDARD_GRAVITY - 1.0) <= GRAVITY_WITHIN:
            return symbol
    return ''


def doubt(quantity: Quantity, size: Size, unit: Unit) -> str:
    """Return why values of that size cannot be `quantity` in `unit`, in words, '' where they can."""
    factor = unit.factor
    if quantity.dimension == 'acceleration':
        return _doubt_of_acceleration(size, unit)
    if quantity.dimension == 'temperature':
        low, high = size.low * factor + unit.zero, size.high * factor + unit.zero
        cold, hot = 200.0, 600.0  # K, chosen: no coil is colder or hotter
        return (
            ''
            if cold <= low and high <= hot
            else f"values of {size.low:.4g} to {size.high:.4g} are no coil's"
        )
    if (size.usual[1] - size.usual[0]) * factor > quantity.most:
        return _beyond(quantity, size, unit, 'more', quantity.most)
    if 0.0 < size.range * factor < quantity.least:
        return _beyond(quantity, size, unit, 'less', quantity.least)
    return ''


def guesses(quantity: Quantity, size: Size) -> tuple[str, ...]:
    """Return the units that values of that size look like, the likeliest first."""
    if quantity.dimension == 'acceleration':
        gravity = gravity_unit(size)
        if gravity:
            return (gravity,)
        candidates: tuple[str, ...] = _ACCELERATIONS
    elif quantity.dimension == 'length':
        candidates = _LENGTHS
    else:
        candidates = _OTHERS.get(
            quantity.dimension, tuple(unit.symbol for unit in units_of(quantity.dimension))
        )
    return tuple(symbol for symbol in candidates if not doubt(quantity, size, unit_of(symbol)))


def _doubt_of_acceleration(size: Size, unit: Unit) -> str:
    at_rest = abs(size.mean) * unit.factor
    largest = max(size.usual[1] - size.mean, size.mean - size.usual[0]) * unit.factor
    if at_rest > LARGEST_MEAN * STANDARD_GRAVITY:
        return f'a mean of {size.mean:.4g} {unit.symbol} is {at_rest / STANDARD_GRAVITY:.3g} times gravity'
    if largest > SHAKEN:
        return (
            f'{largest / unit.factor:.4g} {unit.symbol} about the mean are {largest:.4g} m/s^2, and no '
            f'chassis is shaken beyond {SHAKEN:g} m/s^2 (chosen)'
        )
    return ''


def _beyond(quantity: Quantity, size: Size, unit: Unit, word: str, bound: float) -> str:
    return (
        f'a range of {size.range:.4g} {unit.symbol} is {word} than {quantity.name} has here '
        f'({bound:g} {quantity.unit.symbol}, chosen)'
    )
