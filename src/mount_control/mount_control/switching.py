"""When damping is on: from one period above the switch-on level until longer below the switch-off level."""

from typing import NamedTuple

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type


class Switching(NamedTuple):
    """Levels in m and the length of one period in samples."""

    on_level: float
    off_level: float
    period: int


STATE = record_type(
    [
        ('place', 'i8'),
        ('magnitude', 'f8'),
        ('samples_above', 'i8'),
        ('samples_below', 'i8'),
        ('active', 'i8'),
    ]
)


@compiled
def transfer(state, window, new_window):
    """Carry the newest of the `window` over to the `new_window` of another period; damping stays as it is."""
    period, new_period = len(window), len(new_window)
    kept = min(period, new_period)
    new_window[:] = 0.0
    for age in range(1, kept + 1):
        new_window[kept - age] = window[(state.place - age) % period]
    state.place = kept % new_period
    state.magnitude = new_window.max()


@compiled
def step(switching, state, window, band_displacement):
    """Take one sample; return (magnitude m, damping active 0 or 1).

    `window` holds |band displacement| of the last period; the magnitude is its highest value. Damping
    is switched on when the magnitude has exceeded the switch-on level for one period, and off when
    the displacement has stayed below the switch-off level for more than one (section 6).
    """
    distance = abs(band_displacement)
    leaving = window[state.place]
    window[state.place] = distance
    state.place = (state.place + 1) % switching.period
    if not 0.0 <= leaving <= state.magnitude:  # spoiled, so the highest value is not known
        state.magnitude = np.nan
    elif distance >= state.magnitude:
        state.magnitude = distance
    elif leaving == state.magnitude:  # only then the others have to be looked at
        state.magnitude = window[: switching.period].max()
    magnitude = state.magnitude

    state.samples_above = state.samples_above + 1 if magnitude > switching.on_level else 0
    state.samples_below = state.samples_below + 1 if distance < switching.off_level else 0
    if state.active == 0 and state.samples_above >= switching.period:
        state.active = 1
    elif state.active == 1 and state.samples_below > switching.period:
        state.active = 0
        state.samples_above = 0
    return magnitude, state.active
