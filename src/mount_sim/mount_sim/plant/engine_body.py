"""The engine as a rigid body on several mounts: heave, roll and pitch; below it a vehicle.

    m z'' = F_z - sum F_i
    I_x phi'' = -sum y_i F_i
    I_y theta'' = sum x_i F_i - h F_r
    d_i = z + y_i phi - x_i theta - z_ci,  F_i: force of mount i on the chassis at displacement d_i
    F_r: elastomer of the torque rod at s = h theta

Axes: x forward, y left, z up, origin in the centre of gravity; phi (roll) lifts the left side, theta (pitch)
lowers the front; small angles. z: heave of the centre of gravity; F_z: force on the engine there.

Below the mounts stand q quarters of a vehicle that move alike (`mount_sim.plant.vehicle`), with one piece of
local chassis at each mount:

    m_u z_u'' = k_t (z_r - z_u) - F_s,  q m_b z_b'' = q F_s - sum F_ci,  m_ci z_ci'' = F_ci + F_i

The step is that of `mount_sim.plant.vehicle`: semi-implicit Euler.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import number_record, record_dtype
from mount_models.arrays import FloatArray
from mount_models.quantity import ParameterError, Quantity
from mount_sim.plant.vehicle import BRANCHES, Elastomer, Vehicle, elastomer_force, stretch_branches

_LOWEST_MODE = 0.5  # Hz, chosen: below it the engine is held by nothing
_FASTEST_STEP = 0.5  # rad in a step, chosen: semi-implicit Euler is stable up to 2

BODY_STATE = number_record(
    *(f'{name}_{what}' for name in ('wheel', 'body', 'engine') for what in ('height', 'velocity')),
    *(f'{name}_{what}' for name in ('roll', 'pitch') for what in ('angle', 'rate')),
    *BRANCHES,
)
"""Heights (m), velocities (m/s), angles (rad) and their rates (rad/s); forces (N) of the rod's branches."""
SUPPORT_STATE = number_record(
    'chassis_height',
    'chassis_velocity',
    'displacement',
    'velocity',
    'mount_force',
    'chassis_acceleration',
    'engine_height',
    *BRANCHES,
)
"""Of one mount, SI: the chassis under it, its motion, force and acceleration of the last step, branches."""


class RigidEngine(NamedTuple):
    """Mass, inertias and torque rod of an engine with its gearbox, mounted across the car.

    A power train of four cylinders: 160 kg, twice the share of one mount in `Vehicle`. The inertias are those
    of a homogeneous box of that mass, 0.9 m along the crank, 0.5 m long and 0.6 m high:
    m (0.9^2 + 0.6^2) / 12 and m (0.5^2 + 0.6^2) / 12. The rod has the branches of the other elastomers in
    proportion to its stiffness.
    """

    mass: Annotated[float, Quantity('kg', 'm: engine with gearbox', 10.0, 1e4)] = 160.0
    roll_inertia: Annotated[
        float, Quantity('kg m^2', 'I_x: about the longitudinal axis, of a box', 0.1, 1e4)
    ] = 15.6
    pitch_inertia: Annotated[float, Quantity('kg m^2', 'I_y: about the crank, of a box', 0.1, 1e4)] = 8.1
    rod_lever: Annotated[float, Quantity('m', 'h: torque rod below the centre of gravity', 0.0, 1.0)] = 0.25
    rod: Elastomer = Elastomer(3e5, 3e4, 3e4, 3e4)


class Support(NamedTuple):
    """One mount of the engine: its place; of the `vehicle` its elastomer and the chassis below it."""

    x: float
    y: float
    vehicle: Vehicle


SUPPORT = record_dtype(Support)


@compiled
def car_step(vehicle, quarters, engine, supports, body, states, road_height, engine_force, beside, dt):
    """Advance `body`, a record of `BODY_STATE`, and `states` (n,) of `SUPPORT_STATE` by `dt` seconds.

    `vehicle`: a `Vehicle`, of which everything but its engine, chassis and elastomer is used, `quarters`
    times; `engine`: a `RigidEngine`; `road_height` z_r in m; `engine_force` F_z in N; `beside` (n,) in N: of
    each mount what acts in it beside its elastomer.
    """
    tyre = vehicle.tyre_stiffness * (road_height - body.wheel_height)
    suspension = vehicle.suspension_stiffness * (
        body.wheel_height - body.body_height
    ) + vehicle.suspension_damping * (body.wheel_velocity - body.body_velocity)
    carriers = 0.0
    for k in range(len(supports)):
        chassis, state = supports[k].vehicle, states[k]
        state.mount_force = elastomer_force(chassis.elastomer, state.displacement, state) + beside[k]
        carrier = chassis.chassis_stiffness * (
            body.body_height - state.chassis_height
        ) + chassis.chassis_damping * (body.body_velocity - state.chassis_velocity)
        carriers += carrier
        state.chassis_acceleration = (carrier + state.mount_force) / chassis.chassis_mass
        state.chassis_velocity += dt * state.chassis_acceleration
        state.chassis_height += dt * state.chassis_velocity
    body.wheel_velocity += dt * (tyre - suspension) / vehicle.wheel_mass
    body.body_velocity += dt * (quarters * suspension - carriers) / (quarters * vehicle.body_mass)
    body.wheel_height += dt * body.wheel_velocity
    body.body_height += dt * body.body_velocity
    _move_engine(engine, supports, body, states, engine_force, dt)


@compiled
def _move_engine(engine, supports, body, states, engine_force, dt):
    """Move the engine by the forces noted in `states`, then the mounts with it."""
    lift, rolling, pitching = engine_force, 0.0, 0.0
    for k in range(len(supports)):
        force = states[k].mount_force
        lift -= force
        rolling -= supports[k].y * force
        pitching += supports[k].x * force
    pitching -= engine.rod_lever * elastomer_force(engine.rod, engine.rod_lever * body.pitch_angle, body)
    body.engine_velocity += dt * (lift / engine.mass)
    body.roll_rate += dt * rolling / engine.roll_inertia
    body.pitch_rate += dt * pitching / engine.pitch_inertia
    body.engine_height += dt * body.engine_velocity
    body.roll_angle += dt * body.roll_rate
    body.pitch_angle += dt * body.pitch_rate
    stretch_branches(engine.rod, body, engine.rod_lever * body.pitch_rate * dt, dt)
    for k in range(len(supports)):
        _take_motion(supports[k], states[k], body, dt)


@compiled
def _take_motion(support, state, body, dt):
    state.engine_height = body.engine_height + support.y * body.roll_angle - support.x * body.pitch_angle
    state.displacement = state.engine_height - state.chassis_height
    state.velocity = (
        body.engine_velocity
        + support.y * body.roll_rate
        - support.x * body.pitch_rate
        - state.chassis_velocity
    )
    stretch_branches(support.vehicle.elastomer, state, state.velocity * dt, dt)


def engine_stiffness(engine: RigidEngine, supports: Sequence[Support]) -> FloatArray:
    """Return the static stiffness (3, 3) against heave (m), roll and pitch (rad); forces N, moments N m."""
    stiffness = np.zeros((3, 3))
    stiffness[2, 2] = engine.rod.static_stiffness * engine.rod_lever * engine.rod_lever
    for support in supports:
        lever = np.array([1.0, support.y, -support.x])
        stiffness += support.vehicle.elastomer.static_stiffness * np.outer(lever, lever)
    return stiffness


def engine_modes(engine: RigidEngine, supports: Sequence[Support]) -> FloatArray:
    """Return the undamped natural frequencies (3,) in Hz, rising, of the engine on a chassis at rest.

    A mode without stiffness has 0 Hz.
    """
    scale = 1.0 / np.sqrt([engine.mass, engine.roll_inertia, engine.pitch_inertia])
    squares = np.linalg.eigvalsh(engine_stiffness(engine, supports) * np.outer(scale, scale))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), dtype=np.float64)


def check_hold(engine: RigidEngine, supports: Mapping[str, Support], step_time: float) -> None:
    """Raise `ParameterError` where nothing holds the engine, or where it moves too fast for the step (s)."""
    modes = engine_modes(engine, list(supports.values()))
    highest = _FASTEST_STEP / (2.0 * np.pi * step_time)
    if not _LOWEST_MODE <= modes[0] <= modes[-1] <= highest:
        raise ParameterError(
            f'the engine on {", ".join(supports)} has natural frequencies of {modes[0]:.3g} .. '
            f'{modes[-1]:.3g} Hz, which must lie within {_LOWEST_MODE:g} .. {highest:.5g} Hz: below, nothing '
            'holds it against heave, roll or pitch; give another place a mount (mounts), or the torque rod '
            'a lever (engine.rod_lever); above, its motion would grow without end: set engine.*, '
            'vehicle.elastomer.* and places closer to their defaults'
        )
