"""What moves around the mount: a quarter vehicle with engine, or the engine alone (all values chosen).

    m_u z_u'' = k_t (z_r - z_u) - F_s,  F_s = k_s (z_u - z_b) + c_s (z_u' - z_b')
    m_b z_b'' = F_s - F_c,              F_c = k_c (z_b - z_c) + c_c (z_b' - z_c')
    m_c z_c'' = F_c + F,   m_e z_e'' = F_e - F,   F = elastomer force + friction force at x = z_e - z_c

Elastomer at x: k_e x + f_1 + f_2 + f_3,  f_j' = k_j x' - f_j / tau_j,  tau_j = 1 / (2 pi corner frequency).

z: heights of wheel (u), body (b), local chassis at the mount (c), engine (e) and road (r) from their rest;
F: mount force on the chassis, positive for x > 0. Semi-implicit Euler; 50 us is short enough for all modes.
"""

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1
from mount_models.arithmetic.record import number_record
from mount_models.quantity import Quantity

FloatArray = npt.NDArray[np.float64]

BRANCHES = ('slow_force', 'middle_force', 'fast_force')
_BODIES = ('wheel', 'body', 'chassis', 'engine')
VEHICLE_STATE = number_record(
    *(f'{body}_{what}' for body in _BODIES for what in ('height', 'velocity')), *BRANCHES
)
"""Heights (m) and velocities (m/s) of the four bodies, forces (N) of the elastomer's branches."""
ENGINE_STATE = number_record('displacement', 'velocity', *BRANCHES)
"""Mount displacement x (m), its velocity (m/s), forces (N) of the elastomer's branches."""


class Elastomer(NamedTuple):
    """Static stiffness k_e, stiffness k_j and corner frequency of each branch; loss factor 0.06 .. 0.08."""

    static_stiffness: Annotated[float, Quantity('N/m', 'k_e: stiffness at rest', 1e3, 1e7)] = 1.6e5
    slow_stiffness: Annotated[float, Quantity('N/m', 'k_1 of the slow branch', 0.0, 1e7)] = 1.6e4
    middle_stiffness: Annotated[float, Quantity('N/m', 'k_2 of the middle branch', 0.0, 1e7)] = 1.6e4
    fast_stiffness: Annotated[float, Quantity('N/m', 'k_3 of the fast branch', 0.0, 1e7)] = 1.6e4
    slow_corner: Annotated[float, Quantity('Hz', 'corner frequency of the slow branch', 0.01, 1e3)] = 2.0
    middle_corner: Annotated[float, Quantity('Hz', 'corner frequency of the middle branch', 0.01, 1e3)] = 10.0
    fast_corner: Annotated[float, Quantity('Hz', 'corner frequency of the fast branch', 0.01, 1e3)] = 50.0


@compiled
def elastomer_force(elastomer, displacement, state):
    """Return the force (N) at `displacement` (m) with the forces of the branches in the record `state`."""
    return (
        elastomer.static_stiffness * displacement + state.slow_force + state.middle_force + state.fast_force
    )


@compiled
def stretch_branches(elastomer, state, displacement_change, dt):
    """Advance the forces of the branches in `state` by `dt` seconds with `displacement_change` in m.

    Exact for a constant velocity within the step.
    """
    e, change = elastomer, displacement_change
    state.slow_force = _maxwell_step(state.slow_force, e.slow_stiffness, e.slow_corner, change, dt)
    state.middle_force = _maxwell_step(state.middle_force, e.middle_stiffness, e.middle_corner, change, dt)
    state.fast_force = _maxwell_step(state.fast_force, e.fast_stiffness, e.fast_corner, change, dt)


@compiled
def _maxwell_step(force, stiffness, corner, displacement_change, dt):
    exponent = 2.0 * math.pi * corner * dt
    lost = -expm1(-exponent)
    return force * (1.0 - lost) + stiffness * displacement_change * lost / exponent


class Vehicle(NamedTuple):
    """Quarter vehicle with the share of the engine that rests on this mount."""

    engine_mass: Annotated[float, Quantity('kg', 'm_e: share of the engine on this mount', 1.0, 1e4)] = 80.0
    chassis_mass: Annotated[float, Quantity('kg', 'm_c: chassis around the mount', 0.1, 1e4)] = 20.0
    body_mass: Annotated[float, Quantity('kg', 'm_b: share of the body', 1.0, 1e5)] = 280.0
    wheel_mass: Annotated[float, Quantity('kg', 'm_u: wheel and what moves with it', 1.0, 1e4)] = 40.0
    chassis_stiffness: Annotated[float, Quantity('N/m', 'k_c: local chassis to body', 1e3, 1e9)] = 8e5
    chassis_damping: Annotated[float, Quantity('N s/m', 'c_c: local chassis to body', 0.0, 1e6)] = 400.0
    suspension_stiffness: Annotated[float, Quantity('N/m', 'k_s: body to wheel', 1e2, 1e7)] = 2.2e4
    suspension_damping: Annotated[float, Quantity('N s/m', 'c_s: body to wheel', 0.0, 1e6)] = 1500.0
    tyre_stiffness: Annotated[float, Quantity('N/m', 'k_t: wheel to road', 1e3, 1e8)] = 2.0e5
    elastomer: Elastomer = Elastomer()


class MountMotion(NamedTuple):
    """Displacement (m), velocity (m/s) after a step; mount force (N), chassis acceleration (m/s^2) in it."""

    displacement: float
    velocity: float
    mount_force: float
    chassis_acceleration: float


@compiled
def vehicle_step(vehicle, state, road_height, engine_force, friction_force, dt):
    """Advance `state`, a record of `VEHICLE_STATE`, by `dt` seconds and return the `MountMotion`.

    `road_height` z_r in m; `engine_force` F_e in N, up; `friction_force` in N: what acts in the mount beside
    the elastomer, at the present displacement.
    """
    displacement = state.engine_height - state.chassis_height
    mount = elastomer_force(vehicle.elastomer, displacement, state) + friction_force
    tyre = vehicle.tyre_stiffness * (road_height - state.wheel_height)
    suspension = vehicle.suspension_stiffness * (
        state.wheel_height - state.body_height
    ) + vehicle.suspension_damping * (state.wheel_velocity - state.body_velocity)
    carrier = vehicle.chassis_stiffness * (
        state.body_height - state.chassis_height
    ) + vehicle.chassis_damping * (state.body_velocity - state.chassis_velocity)
    chassis_acceleration = (carrier + mount) / vehicle.chassis_mass

    state.wheel_velocity += dt * (tyre - suspension) / vehicle.wheel_mass
    state.body_velocity += dt * (suspension - carrier) / vehicle.body_mass
    state.chassis_velocity += dt * chassis_acceleration
    state.engine_velocity += dt * (engine_force - mount) / vehicle.engine_mass
    state.wheel_height += dt * state.wheel_velocity
    state.body_height += dt * state.body_velocity
    state.chassis_height += dt * state.chassis_velocity
    state.engine_height += dt * state.engine_velocity

    velocity = state.engine_velocity - state.chassis_velocity
    stretch_branches(vehicle.elastomer, state, velocity * dt, dt)
    return MountMotion(state.engine_height - state.chassis_height, velocity, mount, chassis_acceleration)


@compiled
def engine_step(vehicle, state, chassis_acceleration, engine_force, friction_force, dt):
    """Advance `state`, a record of `ENGINE_STATE`, by `dt` seconds and return the `MountMotion`.

    `chassis_acceleration` in m/s^2, up; forces as in `vehicle_step`.
    """
    mount = elastomer_force(vehicle.elastomer, state.displacement, state) + friction_force
    state.velocity += dt * ((engine_force - mount) / vehicle.engine_mass - chassis_acceleration)
    state.displacement += dt * state.velocity
    stretch_branches(vehicle.elastomer, state, state.velocity * dt, dt)
    return MountMotion(state.displacement, state.velocity, mount, chassis_acceleration)


@compiled
def ride_without_friction(vehicle, state, road_height, engine_force, dt, damping=0.0, first=0):
    """Return (mount displacement, chassis acceleration), each (n,), for road heights and engine forces (n,).

    Friction is off; a viscous damper (N s/m) acts from the step `first` on. `state` (1,) of `VEHICLE_STATE`
    is advanced in place. SI units, steps of `dt` seconds.
    """
    displacement = np.zeros(road_height.size)
    acceleration = np.zeros(road_height.size)
    force = 0.0
    for k in range(road_height.size):
        motion = vehicle_step(vehicle, state[0], road_height[k], engine_force[k], force, dt)
        displacement[k] = motion.displacement
        acceleration[k] = motion.chassis_acceleration
        force = damping * motion.velocity if k + 1 >= first else 0.0
    return displacement, acceleration


def resting_vehicle() -> npt.NDArray[Any]:
    """Return the state (1,) of a vehicle at rest; pass element 0 to `vehicle_step`."""
    return np.zeros(1, VEHICLE_STATE)
