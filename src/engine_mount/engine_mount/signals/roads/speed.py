"""The speed of the car over a road: one number, or recorded over time."""

import ast
import operator
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from engine_mount.signals.formats.measured import Measured
from engine_mount.signals.formats.reading import read
from engine_mount.signals.roads.profile import FloatArray, ProfileError
from engine_mount.signals.units import is_unit, unit_of

SLOWEST, FASTEST = 0.5, 90.0
"""m/s, chosen: below, no wave within the body's and the engine's range is met; above, km/h are meant."""
_DOUBTED = 45.0  # m/s, chosen: above 162 km/h a number in km/h is as likely
_UNITS = ('m/s', 'km/h', 'kmh', 'kph', 'mph')  # behind a number
_NAMES = ('speed', 'v', 'velocity', 'vehicle_speed', 'geschwindigkeit')
_TIMES = ('t', 'time', 'timestamp', 'time_s', 't_s', 'seconds', 'zeit')
_LONGEST_GAP = 1.0  # s, chosen: a car's speed between two values so far apart is near the line through them
_OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}


class Speed(NamedTuple):
    """Speeds (n,) in m/s at times (n,) in s, straight between them; a constant one has a single value."""

    times: FloatArray
    values: FloatArray
    told: str

    @property
    def mean(self) -> float:
        """Mean over the time, m/s."""
        if self.values.size == 1:
            return float(self.values[0])
        return float(np.trapezoid(self.values, self.times) / (self.times[-1] - self.times[0]))

    def notes(self) -> tuple[str, ...]:
        """Return what is to be doubted about it."""
        top = float(self.values.max())
        if top <= _DOUBTED:
            return ()
        return (
            f'{top:g} m/s are {3.6 * top:.0f} km/h; if {top:g} km/h are meant, write --speed {top:g}/3.6',
        )


def speed_of(text: str) -> Speed:
    """Return the speed that `text` tells: m/s as in 60/3.6, with a unit as in 60km/h, or a file over time.

    Raises `ProfileError`, or what reading the file raises.
    """
    number = _arithmetic(text)
    if number is None:
        return recorded_speed(read(text))
    if not SLOWEST <= number <= FASTEST:
        guess = f'; is it in km/h? Write {text}/3.6' if SLOWEST <= number / 3.6 <= FASTEST else ''
        raise ProfileError(
            f'--speed {text} is {number:g} m/s; it must lie within {SLOWEST:g} .. {FASTEST:g} m/s{guess}'
        )
    told = f'{number:.4g} m/s ({3.6 * number:.4g} km/h)'
    return Speed(np.zeros(1), np.array([number]), told)


def recorded_speed(measured: Measured) -> Speed:
    """Return the speed in a table with a time in s and a speed with its unit; raises `ProfileError`."""
    file = Path(measured.provenance.uri).name
    columns = {column.name.casefold(): column for column in reversed(measured.columns.values())}
    column = next((columns[name] for name in _NAMES if name in columns), None)
    if column is None:
        raise ProfileError(
            f'{file}: no column of the speed; name one {", ".join(_NAMES)}; there are {", ".join(columns)}'
        )
    if not is_unit(column.unit) or unit_of(column.unit).dimension != 'velocity':
        guess = 'm/s' if np.nanmax(column.values) < FASTEST / 2 else 'km/h'
        why = f'the unit {column.unit!r}, which is no speed' if column.unit else 'no unit in its header'
        raise ProfileError(
            f'{file}: column {column.name!r} has {why}; write it as in {column.name} [{guess}]'
        )
    if column.time is not None:
        times = column.time.times
    else:
        time = next((columns[name] for name in _TIMES if name in columns), None)
        if time is None or time.unit not in ('', 's'):
            raise ProfileError(
                f'{file}: the speed needs a time in s beside it, in a column {", ".join(_TIMES)}'
            )
        times = time.values
    return _checked(file, np.asarray(times - times[0]), unit_of(column.unit).to_si(column.values))


def _checked(file: str, times: FloatArray, values: FloatArray) -> Speed:
    known = np.isfinite(times) & np.isfinite(values)
    times, values = times[known], values[known]
    if times.size < 2:
        raise ProfileError(
            f'{file} holds {times.size} speeds; at least 2 are needed, or a number as in 60/3.6'
        )
    steps = np.diff(times)
    if np.any(steps <= 0.0):
        place = int(np.argmax(steps <= 0.0))
        raise ProfileError(
            f'{file}: time does not rise: {times[place]:g} s is followed by {times[place + 1]:g} s'
        )
    if steps.max() > _LONGEST_GAP:
        place = int(steps.argmax())
        raise ProfileError(
            f'{file}: no speed from {times[place]:g} to {times[place + 1]:g} s; up to {_LONGEST_GAP:g} s are '
            'bridged'
        )
    if values.min() < 0.0 or values.max() > FASTEST:
        place = int(np.argmax((values < 0.0) | (values > FASTEST)))
        raise ProfileError(
            f'{file}: the speed at {times[place]:g} s is {values[place]:g} m/s; it must lie within 0 .. '
            f'{FASTEST:g} m/s: is its unit another one?'
        )
    told = f'{values.min():.3g} .. {values.max():.3g} m/s as in {file}'
    return Speed(times, values, told)


def _arithmetic(text: str) -> float | None:
    """Return the number that `text` is, None where it is none."""
    match = re.fullmatch(r'([^a-zA-Z]+?)\s*([a-z]+(?:/[a-z])?)?', text.strip())
    if match is None or match[2] not in (None, *_UNITS):
        return None
    try:
        number = _value(ast.parse(match[1].strip(), mode='eval').body)
    except (SyntaxError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return number * unit_of(match[2] or 'm/s').factor


def _value(node: ast.expr) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return float(_OPERATORS[type(node.op)](_value(node.left), _value(node.right)))
    raise ValueError('no arithmetic')
