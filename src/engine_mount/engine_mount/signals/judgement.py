"""In which unit a column is: what hand, mapping file and header say, weighed against its values.

A guess is only ever named in a refusal or a note; it never chooses.
"""

import numpy as np

from engine_mount.signals.formats.measured import MeasuredColumn
from engine_mount.signals.mapping import ColumnChoice
from engine_mount.signals.quantities import Quantity
from engine_mount.signals.signal import FloatArray, SignalError, mean
from engine_mount.signals.units import STANDARD_GRAVITY, Unit, find_unit, unit_of, units_of

GRAVITY_WITHIN = 0.06
"""Share of standard gravity, chosen: a tilt of 20 degrees, or the error of a common sensor."""
LARGEST_MEAN = 1.6
"""Standard gravities, chosen: no accelerometer at rest shows more, whatever its error."""
SHAKEN = 50.0
"""m/s^2, chosen: five times gravity shakes no chassis but in a crash, and is soon reached by a wrong unit."""
_SAME_FACTOR = 0.01  # chosen: a calibration differs from a unit's factor by less
_USUAL = (0.5, 99.5)
"""Percentiles, chosen: what lies beyond may be faults, of which the command that takes the values tells."""
_LOOKED_AT = 100_000  # values, chosen: enough for percentiles
_NAMED = 4  # units in a refusal


def unit_of_column(
    where: str, column: MeasuredColumn, wanted: Quantity, choice: ColumnChoice, option: str
) -> tuple[Unit, float, list[str]]:
    """Return the unit of a column, the factor on its SI values, and sentences on what was taken for granted.

    The hand goes before the header. A scale is a factor on the value in the unit that stands beside it; of a
    unit in the header alone it may turn an axis (-1), or be the factor of that unit itself; without any unit
    it leads to SI. `option` is how a command says a column. Raises `SignalError` where values cannot be in
    that unit, or look like another that no hand excludes.
    """

    def write(symbol: str) -> str:
        return f'write {option.format(quantity=wanted.name, column=column.name, unit=symbol)}'

    size, notes = _size(column.values), []
    header = find_unit(column.unit, wanted.dimension)
    said = unit_of(choice.unit, wanted.dimension) if choice.unit else None
    unit, scale = said or header or wanted.unit, 1.0 if choice.scale is None else choice.scale
    if unit.dimension != wanted.dimension:
        who = 'you say' if said else 'its header says'
        raise SignalError(
            f'{where} is in {unit.symbol}, as {who}: that is of {unit.dimension}, but {wanted.name} is of '
            f'{wanted.dimension}; name another column or quantity'
        )
    if column.unit and not header:
        notes.append(f'{column.name}: the unit {column.unit!r} in its header is not known here')
    if said and header and header != said:
        notes.append(f'{column.name}: its header says {header.symbol}; taken as {choice.unit}, as you say')
    if header and not said and abs(scale) != 1.0:
        if abs(abs(scale) / unit.factor - 1.0) > _SAME_FACTOR:
            raise SignalError(
                f'{where}: its header says {unit.symbol} ({unit.factor:g} {wanted.unit.symbol} each), the '
                f'scale says {scale:g}: {write(unit.symbol)} with the scale of a calibration, or of an axis '
                '(-1)'
            )
        scale /= unit.factor
    gravity, plain = _gravity_unit(wanted, scale * size), _gravity_unit(wanted, size)
    in_gravity = f'a mean of {size[0]:.4g} is gravity in {gravity}'
    # what the values look like, the likeliest first
    fitting = [one.symbol for one in units_of(wanted.dimension) if not _doubt(wanted, one.to_si(size))]
    looks = [plain] if plain else fitting[:_NAMED]
    remedy = f'in no unit of {wanted.dimension} would it be {wanted.name}: is it another column?'
    if looks:
        remedy = f'it could be {", ".join(looks)}: {write(looks[0])}, or the one that it is'
    if not (said or header or choice.scale is not None):
        if gravity == unit.symbol or (wanted.dimension == 'length' and looks[:1] == [unit.symbol]):
            seen = f'{in_gravity}: ' if gravity else ''
            notes.append(f'{column.name}: no unit is said; {seen}taken as {unit.symbol}')
            return unit, scale, notes
        seen = in_gravity if gravity else f'values from {size[1]:.4g} to {size[2]:.4g}'
        raise SignalError(f'{where}: no unit is said; {seen}; {remedy}')
    scaled = '' if scale == 1.0 else f'with the scale of {scale:g} '
    why = _doubt(wanted, scale * unit.to_si(size))
    if why:
        raise SignalError(f'{where}: {scaled}{why}; {remedy}')
    if gravity and unit_of(gravity) != unit:
        if not said:
            raise SignalError(
                f'{where}: {scaled}{in_gravity}, not in {unit.symbol}: {write(gravity)}, or '
                f'{write(unit.symbol)} if that is right'
            )
        notes.append(f'{column.name}: {in_gravity}; taken as {unit.symbol}, as you say')
    if not said and not header and scale != 1.0:
        notes.append(f'{column.name}: factor {scale:g} to {unit.symbol}, as you say')
    return unit, scale, notes


def _size(values: FloatArray) -> FloatArray:
    """Return mean, lowest, highest and usual lowest and highest of values (n,)."""
    low, high = values.min(), values.max()
    usual = np.percentile(values[:: max(1, values.size // _LOOKED_AT)], _USUAL)
    # one that is all the same has that mean, which a sum would miss by its rounding
    return np.array([mean(values) if high > low else low, low, high, *usual])


def _doubt(wanted: Quantity, size: FloatArray) -> str:
    """Return why values of that size (SI) cannot be the quantity, '' where they can."""
    symbol = wanted.unit.symbol
    if wanted.dimension == 'acceleration':
        gravities = abs(size[0]) / STANDARD_GRAVITY
        shaken = float(np.abs(size[3:] - size[0]).max())
        if gravities > LARGEST_MEAN:
            return f'a mean of {size[0]:.4g} {symbol} is {gravities:.3g} times gravity'
        if shaken > SHAKEN:
            return (
                f'{shaken:.4g} {symbol} about the mean, and no chassis is shaken beyond {SHAKEN:g} {symbol} '
                '(chosen)'
            )
        return ''
    if wanted.by_size:
        what, least, most = 'a largest value', *(float(np.abs(part).max()) for part in (size[1:3], size[3:]))
    else:
        what, least, most = 'a range', float(abs(size[2] - size[1])), float(abs(size[4] - size[3]))
    has = f'{wanted.name} has here (chosen)'
    if most > wanted.most:
        return f'{what} of {most:.4g} {symbol} is more than the {wanted.most:g} {symbol} that {has}'
    if least < wanted.least and (least > 0.0 or wanted.by_size):
        return f'{what} of {least:.4g} {symbol} is less than the {wanted.least:g} {symbol} that {has}'
    return ''


def _gravity_unit(wanted: Quantity, size: FloatArray) -> str:
    """Return the unit of acceleration in which the mean is that of gravity, '' where it is in none."""
    for unit in units_of('acceleration') if wanted.dimension == 'acceleration' else ():
        if abs(abs(size[0]) * unit.factor / STANDARD_GRAVITY - 1.0) <= GRAVITY_WITHIN:
            return unit.symbol
    return ''
