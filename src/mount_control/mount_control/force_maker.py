"""From a wanted friction force to a coil current, the same for every policy.

Friction can only oppose motion, and its coefficient depends on the normal force; so the friction law is
inverted for the force and carried on by one step, and the current-force table of the activation gives the
current.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.arithmetic.sums import interpolated
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import normal_force_for, simplified_step_with, speed_terms

FADE_TIME = 0.050
"""s, chosen: in it the current goes over to a new law: first it stands for a sample, and its distance from
what the new law asks for then falls evenly to zero."""
FORCE_STEP = 0.5  # N, chosen: the table's own step
_FIRST_TOUCH = 1.0  # N, chosen
_HIGHEST_FORCE = 1e4  # N, chosen: far beyond any magnet of this size; the table has a place for every 0.5 N
_BEYOND, _FALLING, _OFFSET = 1, 2, 3  # what is wrong with a table


class ForceTableError(ValueError):
    """A current-force table cannot be used; the text says why."""


class CurrentLimits(NamedTuple):
    """`offset_current` (A) holds the pads ready, `highest_current` (A) limits every setpoint."""

    offset_current: float
    highest_current: float


class CurrentTable(NamedTuple):
    """Currents in A at the normal forces 0, `FORCE_STEP`, 2 `FORCE_STEP`, ... and their limits."""

    currents: NDArray[np.float64]
    limits: CurrentLimits


class Law(NamedTuple):
    """The friction that is assumed of the pads, and the limits of the current."""

    friction: FrictionCoefficients
    contact: FrictionContact
    limits: CurrentLimits
    sample_time: float
    fade_samples: int


STATE = record_type(
    [
        ('deflection', 'f8'),
        ('normal_force', 'f8'),
        ('current', 'f8'),
        ('distance', 'f8'),
        ('fading', 'i8'),
        ('on', 'i8'),
    ]
)


def resample(
    current: NDArray[np.float64],
    normal_force: NDArray[np.float64],
    offset_current: float,
    highest_current: float,
) -> CurrentTable:
    """Return the table of `current` (A) over `normal_force` (N), (n,) and rising, on an even grid of forces.

    Raises `ForceTableError` where it does not rise from the first touch, reaches beyond any magnet, or the
    offset current lies outside.
    """
    forces = np.array(normal_force, float)  # copies: one type to compile
    currents = np.array(current, float)
    fault = table_fault(currents, forces, offset_current, highest_current)
    if fault == _BEYOND:
        raise ForceTableError(
            f'current_force_table reaches from {normal_force[0]:.2f} to {normal_force[-1]:g} N (limits: '
            f'first touch of the pads within 0 .. {_FIRST_TOUCH:g} N, end up to {_HIGHEST_FORCE:g} N); '
            'activate mount_init again'
        )
    if fault == _FALLING:
        raise ForceTableError(
            'current and normal force of the current_force_table must rise strictly; '
            'activate mount_init again'
        )
    if fault == _OFFSET:
        raise ForceTableError(
            f'offset_current ({offset_current:.3f} A) must lie within 0 .. {highest_current:g} A; '
            'activate mount_init again, or raise highest_current'
        )
    even = np.empty(places_of(forces))
    fill_table(even, currents, forces)
    return CurrentTable(even, CurrentLimits(float(offset_current), float(highest_current)))


@compiled
def table_fault(current, normal_force, offset_current, highest_current):
    """Return 0 for a table (A over N, (n,)) that can be used, else what is wrong: `_BEYOND` and so on."""
    last = len(normal_force) - 1
    if not (0.0 <= normal_force[0] <= _FIRST_TOUCH and normal_force[last] <= _HIGHEST_FORCE):
        return _BEYOND
    for place in range(1, len(normal_force)):
        if not (normal_force[place] > normal_force[place - 1] and current[place] > current[place - 1]):
            return _FALLING
    return 0 if 0.0 < offset_current < highest_current else _OFFSET


@compiled
def places_of(normal_force):
    """Return how many forces `FORCE_STEP` apart lie below the last of `normal_force` (N)."""
    last = normal_force[len(normal_force) - 1] / FORCE_STEP
    return int(last) + (1 if int(last) < last else 0)


@compiled
def fill_table(even, current, normal_force):
    """Fill `even` with the currents (A) at 0, `FORCE_STEP`, 2 `FORCE_STEP`, ... N."""
    for place in range(len(even)):
        even[place] = interpolated(place * FORCE_STEP, normal_force, current)


@compiled
def begin_fade(law, state):
    """Let the current go over to a new law from where it is; off, the new law acts at once."""
    state.fading = law.fade_samples if state.on == 1 else 0


@compiled
def make(law, currents, state, force, velocity, active):
    """Return (normal force N, friction coefficient, current A) that make a friction `force` (N).

    `velocity` (m/s) is that at which it will act. At `active` 0 all is off: 0 N, no coefficient, 0 A. Else
    the current is at least the offset current, at most its limit; a force against the sign of the velocity
    counts as 0 N, for friction cannot make it.
    """
    normal_force, coefficient, current = 0.0, np.nan, 0.0
    of_speed = speed_terms(law.friction, velocity)
    state.on = 1 if active != 0.0 else 0
    if state.on == 1:
        wanted = 0.0 if force * velocity < 0.0 else force
        normal_force, coefficient = _normal_force(of_speed, law, currents, state, wanted, velocity)
        current = _faded(law, state, current_for(currents, law.limits, normal_force))
    else:
        state.fading = 0
    state.current = current
    _, state.deflection, _ = simplified_step_with(
        of_speed, law.contact, law.friction, state.deflection, velocity, normal_force, law.sample_time
    )
    state.normal_force = normal_force
    return normal_force, coefficient, current


@compiled
def _faded(law, state, wanted):
    """Return the current (A) instead of the `wanted` one, beside it for a while after a change of the law."""
    if state.fading == 0:
        return wanted
    if state.fading == law.fade_samples:
        state.distance = state.current - wanted
    current = wanted + state.distance * state.fading / law.fade_samples
    state.fading -= 1
    return min(max(current, law.limits.offset_current), law.limits.highest_current)


@compiled
def _normal_force(of_speed, law, currents, state, wanted, velocity):
    """Return (normal force N, friction coefficient) that make the wanted force, within the table."""
    direction = -1.0 if velocity < 0.0 else 1.0
    force, coefficient = normal_force_for(
        of_speed, law.friction, wanted, velocity, direction * state.deflection, state.normal_force
    )
    return min(force, highest_force(currents)), coefficient


@compiled
def highest_force(currents):
    """Return the largest normal force in N that the table holds."""
    return FORCE_STEP * (len(currents) - 1)


@compiled
def current_for(currents, limits, normal_force):
    """Return the current in A for a normal force in N, within `limits`; 0 A where it is not a number."""
    if math.isnan(normal_force):
        return 0.0  # as a place in the table it would be anywhere in memory
    place = max(normal_force, 0.0) / FORCE_STEP
    last = len(currents) - 1
    if place >= last:
        current = currents[last]
    else:
        left = int(place)
        share = place - left
        current = (1.0 - share) * currents[left] + share * currents[left + 1]
    return min(max(current, limits.offset_current), limits.highest_current)
