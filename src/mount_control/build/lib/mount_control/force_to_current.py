"""Normal force to coil current through the table of this activation."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.interpolation import each_interpolated

FORCE_STEP = 0.5  # N, chosen: the table's own step
_FIRST_TOUCH = 1.0  # N, chosen
_HIGHEST_FORCE = 1e4  # N, chosen: far beyond any magnet of this size; the table has a place for every 0.5 N


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
    if not 0.0 <= normal_force[0] <= _FIRST_TOUCH:
        raise ForceTableError(
            f'current_force_table starts at {normal_force[0]:.2f} N (limit {_FIRST_TOUCH:g} N), '
            'not at the first touch of the pads; activate mount_init again'
        )
    if not (np.all(np.diff(normal_force) > 0.0) and np.all(np.diff(current) > 0.0)):
        raise ForceTableError(
            'current and normal force of the current_force_table must rise strictly; '
            'activate mount_init again'
        )
    if not normal_force[-1] <= _HIGHEST_FORCE:
        raise ForceTableError(
            f'current_force_table ends at {normal_force[-1]:g} N (limit {_HIGHEST_FORCE:g} N), more than '
            'the magnet can pull; activate mount_init again'
        )
    if not 0.0 < offset_current < highest_current:
        raise ForceTableError(
            f'offset_current ({offset_current:.3f} A) must lie within 0 .. {highest_current:g} A; '
            'activate mount_init again, or raise highest_current'
        )
    forces = np.arange(0.0, normal_force[-1], FORCE_STEP)
    return CurrentTable(
        each_interpolated(forces, np.array(normal_force), np.array(current)),  # copies: one type to compile
        CurrentLimits(float(offset_current), float(highest_current)),
    )


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
