"""Simplified friction model for control, Eq (9): sliding velocity = measured velocity, no spring c_Re."""

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1
from mount_models.friction.coefficient import (
    dynamic_coefficient_with,
    load_within_limits,
    offset_coefficient_with,
    slope_coefficient,
    speed_logarithm,
)

FADE_VELOCITY = 0.001
"""v_w in m/s (chosen): below it the weight 1 - exp(-(v/v_w)^2) fades mu to zero, because the simplified
model knows no sticking (Sec. 4)."""
FADED_BELOW = 2.5 * FADE_VELOCITY
"""Speed in m/s below which mu is faded by more than 0.2 % (derived)."""
LOWEST_COEFFICIENT = 0.05
"""Floor of mu when a force is divided by it (chosen)."""
_DAMPED_STEPS = 5
_DAMPING = 0.8  # mu grows at most like F_N to the power 0.45, so each step leaves at most 0.2 of the error


@compiled
def simplified_step(contact, coefs, deflection, velocity, normal_force, dt):
    """Return (force, new deflection, coefficient) after `dt` seconds at constant velocity and normal force.

    Eq (9) in its right form: F_F = sign(v) mu F_N and d_R xi' = F_F - c_R xi (the print multiplies mu
    by F_F). Because mu is linear in xi, xi is integrated exactly, so no step is too long.
    `deflection` xi in m, `velocity` in m/s, forces in N; `coefficient` is mu after fading, so that
    |force| = coefficient x normal force.
    """
    of_speed = speed_terms(coefs, velocity)
    return simplified_step_with(of_speed, contact, coefs, deflection, velocity, normal_force, dt)


@compiled
def simplified_step_with(of_speed, contact, coefs, deflection, velocity, normal_force, dt):
    """Return `simplified_step` with the `speed_terms` of `velocity`."""
    fading, logarithm = of_speed
    load = max(normal_force, 0.0)
    direction = -1.0 if velocity < 0.0 else 1.0
    weight = fading * coefs.scale
    drive = direction * weight * load * offset_coefficient_with(logarithm, coefs, velocity, load)
    stiffness = contact.tangential_stiffness - weight * load * slope_coefficient(coefs, velocity, load)
    advance = _relaxation(stiffness * dt / contact.tangential_damping)
    new_deflection = deflection + (drive - stiffness * deflection) * advance * dt / contact.tangential_damping
    u = direction * new_deflection
    coefficient = fading * dynamic_coefficient_with(logarithm, coefs, velocity, u, load)
    return direction * coefficient * load, new_deflection, coefficient


@compiled
def simplified_response(contact, coefs, velocity, normal_force, dt):
    """Return (force, deflection) from rest for `velocity` and `normal_force`, all arrays (n,), SI units."""
    force = np.zeros(velocity.size)
    deflection = np.zeros(velocity.size)
    xi = 0.0
    for k in range(velocity.size):
        force[k], xi, _ = simplified_step(contact, coefs, xi, velocity[k], normal_force[k], dt)
        deflection[k] = xi
    return force, deflection


@compiled
def speed_terms(coefs, velocity):
    """Return what depends on the size of `velocity` (m/s) alone: the weight that fades mu, the logarithm."""
    return fade_weight(velocity), speed_logarithm(coefs, velocity)


@compiled
def fade_weight(velocity):
    """Return 1 - exp(-(v/v_w)^2) for `velocity` in m/s."""
    share = velocity / FADE_VELOCITY
    return -expm1(-(share * share))  # ** of plain Python rounds otherwise than that of the compiler


@compiled
def normal_force_for(of_speed, coefs, desired_force, velocity, deflection_u, start):
    """Return (normal force, coefficient) that give the magnitude of `desired_force` (N) at `velocity`.

    The inverse of the faded coefficient: mu depends on F_N, so F_N = F / mu(F_N) is solved by fixed-point
    steps from `start` (the last value, N). mu counts at least `LOWEST_COEFFICIENT`. u in m; `of_speed` are
    the `speed_terms` of the velocity.
    """
    fading, logarithm = of_speed
    wanted = abs(desired_force)
    normal_force, known, coefficient, fitting = start, np.nan, 0.0, 0.0
    for step in range(_DAMPED_STEPS + 1):
        load = load_within_limits(coefs, normal_force)
        if load != known:  # beyond the limits mu is that of the step before
            known = load
            mu = fading * dynamic_coefficient_with(logarithm, coefs, velocity, deflection_u, load)
            coefficient = max(mu, LOWEST_COEFFICIENT)
            fitting = wanted / coefficient
        if step < _DAMPED_STEPS:
            normal_force += _DAMPING * (fitting - normal_force)
    return fitting, coefficient


@compiled
def _relaxation(exponent):
    """Return (1 - exp(-z)) / z, which is 1 at z = 0."""
    if abs(exponent) < 1e-8:
        return 1.0 - 0.5 * exponent
    return -expm1(-exponent) / exponent
