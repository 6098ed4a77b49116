"""How the simulated actuator closes: magnet against spring and pads, quasi-static, with snap-through.

It belongs to the plant: the magnet is `reluctance`. The controller's estimate of the same
forces is `mount_models.actuator`.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import ParameterError, Quantity, checked
from mount_sim.plant.reluctance import ReluctanceActuator, force, force_and_gap_slope


class ClosingMechanics(NamedTuple):
    """Spring and pads seen at the air gap; both gaps are those between the core halves."""

    spring_stiffness: Annotated[float, Quantity('N/m', 'stiffness k_s of both halves', 1e3, 1e7)] = 1.4e5
    pad_stiffness: Annotated[float, Quantity('N/m', 'stiffness k_p of the pads in contact', 5e6, 1e10)] = 2e7
    contact_gap: Annotated[
        float, Quantity('m', 'gap d_c at which the pads touch', 5e-5, 2e-3, 'section 3.2')
    ] = 349e-6
    rest_gap: Annotated[
        float,
        Quantity('m', 'gap d_rest at 0 A, chosen to give the 492 um of section 3.2 at 0.2 A', 5e-5, 2e-3),
    ] = 508e-6


@compiled
def closed_state(mechanics, actuator, current, previous_gap):
    """Return the air gap (m) and the normal force on the pads (N) that settle at a steady `current` (A).

    From `previous_gap` (m) the halves move with the net force until it vanishes, so the state follows its
    branch, snaps shut where the open equilibrium ends, and opens again only where the contact ends:
    open, F_mag = k_s (d_rest - d); in contact, F_mag = k_s (d_rest - d) + k_p (d_c - d).
    NaN where an argument is not finite.
    """
    if not (math.isfinite(current) and math.isfinite(previous_gap)):
        return math.nan, math.nan
    contact_gap = mechanics.contact_gap
    contact_pull = _pull(mechanics, actuator, current, contact_gap)[0]
    if previous_gap <= contact_gap:
        gap = contact_gap if contact_pull >= 0.0 else _gap_above(mechanics, actuator, current, contact_gap)
    else:
        gap = _gap_from_open(mechanics, actuator, current, previous_gap)
    if gap > contact_gap:
        return gap, 0.0
    normal_force = _normal_force(mechanics, actuator, current, max(contact_pull, 0.0))
    return contact_gap - normal_force / mechanics.pad_stiffness, normal_force


@compiled
def contact_force(mechanics):
    """Return the magnetic force F_c = k_s (d_rest - d_c) (N) at which the pads just touch."""
    return mechanics.spring_stiffness * (mechanics.rest_gap - mechanics.contact_gap)


def checked_closing(mechanics: ClosingMechanics, actuator: ReluctanceActuator) -> ClosingMechanics:
    """Return `mechanics` with every value in range, or raise `ParameterError`.

    Refused are pads that touch already at rest, and springs that the magnet never overcomes.
    """
    mechanics = checked(mechanics)
    if not mechanics.contact_gap < mechanics.rest_gap:
        raise ParameterError(
            f'contact_gap ({mechanics.contact_gap * 1e6:.1f} um) must lie below rest_gap '
            f'({mechanics.rest_gap * 1e6:.1f} um): without current the pads must be free of the rod'
        )
    if force(actuator, _HOPELESS_CURRENT, mechanics.contact_gap) < contact_force(mechanics):
        raise ParameterError(
            f'contact force ({contact_force(mechanics):.1f} N) is beyond what the magnet reaches at a gap of '
            f'{mechanics.contact_gap * 1e6:.1f} um; lower spring_stiffness or bring the gaps closer together'
        )
    return mechanics


_HOPELESS_CURRENT = 100.0  # A
_GAP_RESOLUTION = 1e-13  # m
_FORCE_RESOLUTION = 1e-9  # N


@compiled
def _pull(mechanics, actuator, current, gap):
    """Return the net closing force (N) on open halves at `gap`, and its slope (N/m)."""
    magnet, magnet_slope = force_and_gap_slope(actuator, current, gap)
    spring = mechanics.spring_stiffness
    return magnet - spring * (mechanics.rest_gap - gap), magnet_slope + spring


@compiled
def _gap_from_open(mechanics, actuator, current, gap):
    """Return the open equilibrium that is reached from `gap`, or the contact gap if there is none on the way.

    Over the gap the net force is convex as long as the core is not saturated: it has at most two zeros,
    of which the upper is the equilibrium. From above Newton's steps fall onto it without ever passing it.
    With a saturated core a step may pass it; then it lies above where the step ended.
    """
    pull, slope = _pull(mechanics, actuator, current, gap)
    if pull < 0.0:
        return _gap_above(mechanics, actuator, current, gap)
    for _ in range(60):
        if slope <= 0.0 or gap - pull / slope <= mechanics.contact_gap:
            contact = mechanics.contact_gap
            if _pull(mechanics, actuator, current, contact)[0] < 0.0:
                return _gap_above(mechanics, actuator, current, contact)
            return contact
        step = pull / slope
        gap -= step
        if abs(step) < _GAP_RESOLUTION:
            return gap
        pull, slope = _pull(mechanics, actuator, current, gap)
        if pull < 0.0:
            return _gap_above(mechanics, actuator, current, gap)
    return gap


@compiled
def _gap_above(mechanics, actuator, current, gap):
    """Return the open equilibrium above a `gap` at which the spring wins; it lies below the rest gap."""
    low, high = gap, mechanics.rest_gap
    for _ in range(80):
        pull, slope = _pull(mechanics, actuator, current, gap)
        if pull < 0.0:
            low = gap
        else:
            high = gap
        following = gap - pull / slope if slope > 0.0 else high
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - gap) < _GAP_RESOLUTION:
            return following
        gap = following
    return gap


@compiled
def _normal_force(mechanics, actuator, current, contact_pull):
    """Return the force (N) on the pads; `contact_pull` (N) is the net pull at the gap where they touch."""
    pads = mechanics.pad_stiffness
    normal_force = contact_pull
    for _ in range(20):
        pull, slope = _pull(mechanics, actuator, current, mechanics.contact_gap - normal_force / pads)
        step = (pull - normal_force) / (1.0 + slope / pads)
        normal_force += step
        if abs(step) < _FORCE_RESOLUTION:
            break
    return max(normal_force, 0.0)
