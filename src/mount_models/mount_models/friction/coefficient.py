"""Dynamic friction coefficient of the two pads together, Eqs (12)-(14), and its inverse in velocity.

mu = a + b u with u = sign(F_F) xi: `offset_coefficient` is a, `slope_coefficient` is b. Outside this
file everything is in SI units; Table 2 and the formulas inside are in mm and mm/s (suffix `_mm`).

mu is the total friction force of two pads over the clamping force (derived: no pad stiffness brings
one pad's coefficient and Table 2 together), so each pad has half of it.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import exp, log
from mount_models.quantity import Quantity

_TABLE_2 = 'Table 2'
_MM_PER_M = 1000.0
_LARGEST_EXPONENT = 700.0  # exp() stays finite
_MOST_STEPS = 60  # three are usual; the limit only bounds the time
_LAST_STEP = 1e-3  # a step so small, relative, leaves its fourth power over 36: 3e-14 (derived)


class FrictionCoefficients(NamedTuple):
    """Parameters of Eqs (12)-(14); index p is sliding to positive velocity, n to negative."""

    b_offset: Annotated[
        float,
        Quantity(
            '1/mm',
            'b_offset: part of the slope b that depends on nothing; the sign is uncertain',
            -30.0,
            30.0,
            'Table 2, printed as 14 N',
        ),
    ] = 14.0
    b_1: Annotated[float, Quantity('1/mm', 'b_1: slope b at rest', -100.0, 100.0, _TABLE_2)] = -18.5
    b_2: Annotated[float, Quantity('s/mm^2', 'b_2: change of b with speed', -10.0, 10.0, _TABLE_2)] = -1.7
    beta_1: Annotated[float, Quantity('1', 'beta_1: b at zero normal force', -5.0, 5.0, _TABLE_2)] = 0.174
    beta_2: Annotated[
        float, Quantity('1/N', 'beta_2: change of b with normal force', -0.1, 0.1, _TABLE_2)
    ] = 8.09e-3
    a_p1: Annotated[float, Quantity('1', 'a_p1: offset a, positive velocity', -5.0, 5.0, _TABLE_2)] = 0.5829
    a_p2: Annotated[
        float,
        Quantity('1', 'a_p2: logarithmic gain of a, positive velocity', 1e-4, 5.0, 'Table 2, printed s/mm'),
    ] = 0.1781
    a_p3: Annotated[
        float, Quantity('1', 'a_p3: shift in the logarithm, positive velocity', 1e-4, 10.0, _TABLE_2)
    ] = 0.118
    a_n1: Annotated[float, Quantity('1', 'a_n1: offset a, negative velocity', -5.0, 5.0, _TABLE_2)] = 0.802
    a_n2: Annotated[
        float,
        Quantity('1', 'a_n2: logarithmic gain of a, negative velocity', 1e-4, 5.0, 'Table 2, printed s/mm'),
    ] = 0.3253
    a_n3: Annotated[
        float, Quantity('1', 'a_n3: shift in the logarithm, negative velocity', 1e-4, 10.0, _TABLE_2)
    ] = 0.4177
    alpha_p1: Annotated[
        float, Quantity('1', 'alpha_p1: a at zero normal force, positive velocity', 1e-4, 5.0, _TABLE_2)
    ] = 0.5829
    alpha_p2: Annotated[
        float,
        Quantity('1/N', 'alpha_p2: change of a with normal force, positive velocity', 0.0, 0.1, _TABLE_2),
    ] = 0.004
    alpha_n1: Annotated[
        float, Quantity('1', 'alpha_n1: a at zero normal force, negative velocity', 1e-4, 5.0, _TABLE_2)
    ] = 0.688
    alpha_n2: Annotated[
        float,
        Quantity('1/N', 'alpha_n2: change of a with normal force, negative velocity', 0.0, 0.1, _TABLE_2),
    ] = 0.0032
    slope_velocity_limit: Annotated[
        float, Quantity('m/s', 'v_b: above this speed b changes no more, so mu rises with speed', 0.0, 1.0)
    ] = 0.010
    lowest_normal_force: Annotated[
        float, Quantity('N', 'below this normal force alpha and beta change no more', 0.0, 1000.0, 'Sec. 4')
    ] = 40.0
    highest_normal_force: Annotated[
        float, Quantity('N', 'above this normal force alpha and beta change no more', 0.0, 1000.0, 'Sec. 4')
    ] = 120.0
    scale: Annotated[
        float, Quantity('1', 'factor on mu: another pad pairing, or a plant unlike its model', 0.05, 5.0)
    ] = 1.0


@compiled
def dynamic_coefficient(coefs, velocity, deflection_u, normal_force):
    """Return mu of Eq (12), never below 0.

    `velocity` in m/s (its sign selects p or n; 0 counts as p), `deflection_u` = u = sign(F_F) xi in m,
    `normal_force` in N.
    """
    logarithm = speed_logarithm(coefs, velocity)
    return dynamic_coefficient_with(logarithm, coefs, velocity, deflection_u, normal_force)


@compiled
def dynamic_coefficient_with(logarithm, coefs, velocity, deflection_u, normal_force):
    """Return `dynamic_coefficient` with the `speed_logarithm` of `velocity`, for several normal forces."""
    offset = offset_coefficient_with(logarithm, coefs, velocity, normal_force)
    slope = slope_coefficient(coefs, velocity, normal_force)
    return max(coefs.scale * (offset + slope * deflection_u), 0.0)


@compiled
def offset_coefficient(coefs, velocity, normal_force):
    """Return a of Eq (14), dimensionless, for `velocity` in m/s and `normal_force` in N."""
    return offset_coefficient_with(speed_logarithm(coefs, velocity), coefs, velocity, normal_force)


@compiled
def offset_coefficient_with(logarithm, coefs, velocity, normal_force):
    """Return `offset_coefficient` with the `speed_logarithm` of `velocity`."""
    amplitude, gain, _ = _offset_parts(coefs, velocity, normal_force)
    return amplitude + gain * logarithm


@compiled
def speed_logarithm(coefs, velocity):
    """Return the logarithm in Eq (14), all that depends on the size of `velocity` (m/s) there."""
    shift = coefs.a_n3 if velocity < 0.0 else coefs.a_p3
    return log(shift + abs(velocity) * _MM_PER_M)


@compiled
def slope_coefficient(coefs, velocity, normal_force):
    """Return b of Eq (13) in 1/m, with the magnitude of `velocity` (m/s) and `normal_force` in N.

    With the signed velocity of the print, b would turn positive at negative velocities.
    """
    constant_mm, per_speed_mm = _slope_parts_mm(coefs, normal_force)
    speed = min(abs(velocity), coefs.slope_velocity_limit)
    return (constant_mm + per_speed_mm * speed * _MM_PER_M) * _MM_PER_M


@compiled
def sliding_speed(coefs, direction, traction, deflection_u, normal_force, resistance):
    """Return the speed >= 0 in m/s at which F_N mu(v, u) + resistance v equals `traction` >= 0.

    The inverse of Eq (12) that Eq (8) asks for; `resistance` (N s/m) is what a time step adds, 0 gives
    the inverse itself. `direction` is +1 or -1. Where mu falls with speed it is replaced by its running
    maximum (the monotone envelope), so there is one speed only; 0 means that the contact sticks.

    Between its corners the sum is rising and concave; from the lower end of the right piece the solution is
    approached from below and never passed (derived).
    """
    if normal_force <= 0.0:
        return traction / resistance if resistance > 0.0 else math.inf
    if traction <= 0.0:
        return 0.0
    amplitude, gain, shift = _offset_parts(coefs, direction, normal_force)
    constant_mm, per_speed_mm = _slope_parts_mm(coefs, normal_force)
    u_mm = deflection_u * _MM_PER_M
    corner = coefs.slope_velocity_limit * _MM_PER_M
    force_per_mu = normal_force * coefs.scale
    # force over speed in mm/s: below the corner rest + log_gain ln(shift + v) + linear v, above it constant b
    rest = force_per_mu * (amplitude + constant_mm * u_mm)
    log_gain = force_per_mu * gain
    linear = force_per_mu * per_speed_mm * u_mm
    drag = resistance / _MM_PER_M

    log_at_rest = log(shift)
    at_rest = rest + log_gain * log_at_rest
    if traction <= at_rest:
        return 0.0
    top = corner
    if linear < 0.0:
        top = min(max(-log_gain / linear - shift, 0.0), corner)
    log_at_top = log(shift + top)
    at_top = rest + log_gain * log_at_top + linear * top
    if at_rest < 0.0 and traction < drag * top:
        free = traction / drag
        if rest + log_gain * log(shift + free) + linear * free <= 0.0:
            return free / _MM_PER_M
    if traction <= at_top + drag * top:
        return _rising_root(rest - traction, log_gain, shift, linear + drag, 0.0, log_at_rest) / _MM_PER_M

    above = rest + linear * corner
    plateau = max(at_top, 0.0)
    plateau_end, log_at_end = corner, log_at_top
    if top < corner or plateau > at_top:
        plateau_end = max(_log_root(above - plateau, log_gain, shift), corner)
        log_at_end = log(shift + plateau_end)
    if traction <= plateau + drag * plateau_end:
        return ((traction - plateau) / drag if drag > 0.0 else top) / _MM_PER_M
    if drag == 0.0:
        return _log_root(above - traction, log_gain, shift) / _MM_PER_M
    return _rising_root(above - traction, log_gain, shift, drag, plateau_end, log_at_end) / _MM_PER_M


@compiled
def _rising_root(constant, log_gain, shift, linear, start, log_at_start):
    """Return v >= start with constant + log_gain ln(shift + v) + linear v = 0; negative at `start`.

    `log_at_start` is ln(shift + start), which the caller has. From v a step of y (shift + v) is taken with
    ln(1 + y) replaced by y (6 + y) / (6 + 4 y): never less (derived), so no step is too long; and so near
    that three steps do what takes Newton's method six.
    """
    speed, logarithm = start, log_at_start
    for _ in range(_MOST_STEPS):
        shifted = shift + speed
        missing = -(constant + log_gain * logarithm + linear * speed)
        along = linear * shifted
        half = 3.0 * (log_gain + along) - 2.0 * missing
        under = half * half + 6.0 * (log_gain + 4.0 * along) * missing
        step = 6.0 * missing / (half + math.sqrt(max(under, 0.0)))
        if step <= 0.0:
            break
        speed += step * shifted
        if not step > _LAST_STEP:  # also where it is not a number
            break
        logarithm = log(shift + speed)
    return speed


@compiled
def _log_root(constant, log_gain, shift):
    return exp(min(-constant / log_gain, _LARGEST_EXPONENT)) - shift


@compiled
def load_within_limits(coefs, normal_force):
    """Return the normal force in N with which mu is that with `normal_force`: beyond it changes no more."""
    return min(max(normal_force, coefs.lowest_normal_force), coefs.highest_normal_force)


@compiled
def _offset_parts(coefs, velocity, normal_force):
    load = load_within_limits(coefs, normal_force)
    if velocity < 0.0:
        factor = coefs.alpha_n1 + coefs.alpha_n2 * load
        return factor * coefs.a_n1, factor * coefs.a_n2, coefs.a_n3
    factor = coefs.alpha_p1 + coefs.alpha_p2 * load
    return factor * coefs.a_p1, factor * coefs.a_p2, coefs.a_p3


@compiled
def _slope_parts_mm(coefs, normal_force):
    load = load_within_limits(coefs, normal_force)
    factor = coefs.beta_1 + coefs.beta_2 * load
    return coefs.b_offset + coefs.b_1 * factor, coefs.b_2 * factor
