"""Full friction model, Eqs (7), (8): sticking, sliding and creep, for the plant.

    u = sign(F_F) xi;  F_F = c_Re (x - x_s - xi);  x_s' = f(F_F, u, F_N);  xi' = (F_F - c_R xi) / d_R

x: displacement, x_s: position of the slider, xi: deflection of the creeping element, F_N: normal force.
An explicit step would have to be shorter than 2 F_N (dmu/dv) / c_Re, which is 1 us at 1 N; backward Euler
has no such limit and needs one scalar solution for the sliding speed per step.
"""

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import sliding_speed


@compiled
def full_step(contact, coefs, slider_position, deflection, displacement, normal_force, dt):
    """Return (force, slider position, deflection, sliding velocity) after `dt` seconds.

    `slider_position` x_s and `deflection` xi in m are the old state, `displacement` x in m and
    `normal_force` in N the new inputs. The force never drives the slider (force x velocity >= 0); it is
    exactly 0 without normal force, and then the slider follows the displacement.
    """
    growth = 1.0 + dt * contact.tangential_stiffness / contact.tangential_damping
    released = deflection / growth
    compliance = dt / (contact.tangential_damping * growth)
    yielding = 1.0 + contact.contact_stiffness * compliance
    # the force if the slider stayed where it is, and what each m/s of sliding takes from it
    trial = contact.contact_stiffness * (displacement - slider_position - released) / yielding
    resistance = contact.contact_stiffness * dt / yielding
    direction = -1.0 if trial < 0.0 else 1.0
    traction = abs(trial)
    speed = sliding_speed(coefs, direction, traction, direction * deflection, normal_force, resistance)
    force = 0.0
    if not normal_force <= 0.0:
        force = direction * max(traction - resistance * speed, 0.0)
    velocity = direction * speed
    return force, slider_position + velocity * dt, released + compliance * force, velocity


@compiled
def full_response(contact, coefs, displacement, normal_force, dt):
    """Return (force, sliding velocity, deflection) for `displacement` and `normal_force`, all arrays (n,).

    The contact starts free of force at the first displacement. SI units, samples `dt` seconds apart.
    """
    count = displacement.size
    force = np.zeros(count)
    sliding_velocity = np.zeros(count)
    deflection = np.zeros(count)
    slider_position = displacement[0]
    xi = 0.0
    for k in range(count):
        force[k], slider_position, xi, sliding_velocity[k] = full_step(
            contact, coefs, slider_position, xi, displacement[k], normal_force[k], dt
        )
        deflection[k] = xi
    return force, sliding_velocity, deflection
