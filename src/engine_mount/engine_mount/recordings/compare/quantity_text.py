"""Numbers with units as people read them: 0.031 A, 12.5 µm, 3.2 ms."""

import math

_SMALLER = {
    'm': (('m', 1.0), ('mm', 1e-3), ('µm', 1e-6), ('nm', 1e-9)),
    's': (('s', 1.0), ('ms', 1e-3), ('µs', 1e-6)),
}
_ROUNDED_UP = 0.9995


def quantity_text(value: float, unit: str, digits: int = 3) -> str:
    """Return `value` (in `unit`, SI) with `digits` significant digits, lengths and times in a handy unit."""
    if math.isnan(value):
        return 'unknown'
    steps = _SMALLER.get(unit, ((unit, 1.0),))
    name, size = next((step for step in steps if abs(value) >= _ROUNDED_UP * step[1]), steps[-1])
    if value == 0.0:
        name, size = steps[0]
    return f'{value / size:.{digits}g} {name}'.rstrip()


def time_text(seconds: float) -> str:
    """Return a time on the axis of a recording, to the millisecond."""
    return f'{seconds:.3f} s'
