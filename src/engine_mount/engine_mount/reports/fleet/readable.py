"""Numbers of a fleet as an engineer reads them: lengths in mm or µm, three digits, no powers of ten."""

import math
from collections.abc import Iterable

_DIGITS = 3  # chosen
_SMALL = 1e-4  # m, chosen: where all is below, µm


def handy_unit(unit: str, values: Iterable[float]) -> tuple[float, str]:
    """Return the factor to the unit in which `values` in `unit` are read, and that unit."""
    if unit != 'm':
        return 1.0, unit
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    return (1e6, 'µm') if 0.0 < largest < _SMALL else (1e3, 'mm')


def number(value: float, *, signed: bool = False) -> str:
    """Return a number with three digits that count."""
    if value == 0.0 or not math.isfinite(value):
        return '0' if value == 0.0 else 'unknown'
    places = max(0, _DIGITS - 1 - math.floor(math.log10(abs(value))))
    return f'{value:{"+" if signed else ""}.{places}f}'


def quantity(value: float, unit: str, *, signed: bool = False) -> str:
    """Return a number in `unit` with the unit in which it is read."""
    factor, shown = handy_unit(unit, [value])
    return ' '.join(filter(None, (number(factor * value, signed=signed), shown)))
