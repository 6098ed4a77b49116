"""Units as rack files write them: the shared table, with suffixes in small letters and rates."""

import re

from engine_mount.signals.units.unit import Unit, UnitError, unit_of, units_of

_RATE = re.compile(r'(.+?)(?:_per_|/)(.+)')


def unit_word(text: str, dimension: str) -> Unit | None:
    """Return the unit of `dimension` that `text` writes, or None; titles write `_mh` and `_n` for mH and N.

    A dimension such as `current/time` is a rate: `a_per_ms`, `A/s`.
    """
    of, stroke, per = dimension.partition('/')
    if stroke:
        match = _RATE.fullmatch(text)
        parts = (unit_word(match[1], of), unit_word(match[2], per)) if match else (None, None)
        above, below = parts
        if above is None or below is None:
            return None
        return Unit(f'{above.symbol}/{below.symbol}', dimension, above.factor / below.factor)
    for spelling in (text, text.upper(), *_symbols(text, of)):
        try:
            unit = unit_of(spelling)
        except UnitError:
            continue
        if unit.dimension == of:
            return unit
    return None


def _symbols(text: str, dimension: str) -> list[str]:
    """Return the symbols of a dimension that `text` writes in small letters."""
    return [unit.symbol for unit in units_of(dimension) if unit.symbol.lower() == text.lower()]
