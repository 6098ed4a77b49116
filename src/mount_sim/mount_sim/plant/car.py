"""One engine on several mounts in one compiled step; do parameters fit the length of a step?

The step of one plant is linearised about rest, so nothing of it is written a second time: each number of what
moves is shifted a little, and what becomes of it in one step is a column of the matrix of the step. Where an
eigenvalue of that lies outside the unit circle, a motion grows from step to step.
"""

from typing import NamedTuple

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype
from mount_models.arrays import ByteArray
from mount_models.friction.contact import check_friction
from mount_models.quantity import ParameterError, flattened
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.engine_body import (
    BODY_STATE,
    SUPPORT,
    SUPPORT_STATE,
    RigidEngine,
    car_step,
)
from mount_sim.plant.hydromount import HYDROMOUNT_STATE
from mount_sim.plant.mounts import Contents
from mount_sim.plant.plant import (
    PLANT,
    STATE,
    Plant,
    advance,
    advance_bench,
    advance_magnet,
    force_beside_elastomer,
    take_motion,
)
from mount_sim.plant.vehicle import ENGINE_STATE, VEHICLE_STATE, MountMotion, Vehicle

QUARTERS = 2.0
"""Of the vehicle, `Vehicle` each: the front half of the car, whose two wheels move alike (chosen)."""
GROWTH_ALLOWED = 1e-6
"""Of a motion in one step, chosen: far above rounding, 2 % in a second."""

_BENCH = int(Seat.BENCH)
_SHIFT = 1e-6  # SI, chosen: small for heights, angles and forces of branches
_SHIFTS = {'volume': 1e-12, 'flow': 1e-9}  # m^3, m^3/s (chosen): within one piece of the hydromount's laws
_MOVING = [*VEHICLE_STATE.names, *ENGINE_STATE.names, *HYDROMOUNT_STATE.names]  # first in `STATE`
_DISPLACEMENT = STATE.fields['displacement'][1] // 8
_NOTHING = np.zeros(1)


class CarLaw(NamedTuple):
    """What the mounts share."""

    engine: RigidEngine = RigidEngine()
    vehicle: Vehicle = Vehicle()


_CAR = record_dtype(CarLaw)


class CarMemory(NamedTuple):
    """Parameters and state as bytes of records, those of the mounts one behind the other."""

    law: ByteArray  # `CarLaw`
    plants: ByteArray  # `PLANT`
    states: ByteArray  # `STATE`
    supports: ByteArray  # `SUPPORT`
    body: ByteArray  # `BODY_STATE`
    motions: ByteArray  # `SUPPORT_STATE`


@compiled
def advance_car(law, plants, states, supports, body, motions, seat, values, engine_forces, wanted, dt):
    """Advance all mounts by one step of `dt` s for each excitation value, with setpoints `wanted` (A).

    `engine_forces` (N, upwards) act on the engine in the same steps. On a bench every mount stands on a rack
    of its own; all racks impose the same displacement.
    """
    laws, nows, places = plants.view(PLANT), states.view(STATE), supports.view(SUPPORT)
    car, moved, moves = law.view(_CAR)[0], body.view(BODY_STATE)[0], motions.view(SUPPORT_STATE)
    beside = np.zeros(len(places))
    for k in range(len(places)):
        nows[k].wanted_current = wanted[k]
    for index in range(len(values)):
        value, force = values[index], engine_forces[index]
        for k in range(len(places)):
            advance_magnet(laws[k], nows[k], dt)
            if seat == _BENCH:
                advance_bench(laws[k], nows[k], value, dt)
            else:
                beside[k] = force_beside_elastomer(laws[k], nows[k], nows[k].displacement, dt)
        if seat == _BENCH:
            continue
        car_step(car.vehicle, QUARTERS, car.engine, places, moved, moves, value, force, beside, dt)
        for k in range(len(places)):
            _take_motion_of(laws[k], nows[k], moves[k], moved, value, dt)


@compiled
def _take_motion_of(law, now, motion, body, value, dt):
    moved = MountMotion(motion.displacement, motion.velocity, motion.mount_force, motion.chassis_acceleration)
    take_motion(law, now, moved, dt)
    now.road_height = value
    now.vehicle.wheel_height = body.wheel_height
    now.vehicle.chassis_height = motion.chassis_height
    now.vehicle.engine_height = motion.engine_height


def checked_plant(plant: Plant, seat: Seat, step_time: float) -> Plant:
    """Return `plant` if it can be simulated in steps of `step_time` s, or raise a `ValueError` that says why.

    Checked are combinations; each number by itself is checked where the plant is made.
    """
    if plant.mount.contents == Contents.PADS:
        check_friction(plant.friction, plant.contact)
    values, defaults = flattened(plant), flattened(Plant())
    parts = ('vehicle.', 'hydromount.')
    changed = [
        f'{name} ({value:g})'
        for name, value in values.items()
        if name.startswith(parts) and value != defaults[name]
    ]
    found = growth(plant, seat, step_time)
    if found > 1.0 + GROWTH_ALLOWED:
        raise ParameterError(
            f'{", ".join(changed)} do not fit together: in steps of {1e6 * step_time:g} us the motion of the '
            f'simulated plant would grow without end, {found:.6g} times in a step; set them closer to their '
            'defaults'
        )
    return plant


def growth(plant: Plant, seat: Seat, step_time: float) -> float:
    """Return by how much the fastest growing free motion about rest is greater after a step, 1 for not."""
    law = record_bytes(plant)
    moving = [*range(len(_MOVING)), _DISPLACEMENT]
    shifts = [next((by for word, by in _SHIFTS.items() if word in name), _SHIFT) for name in _MOVING]
    shifts.append(_SHIFT)
    states = np.zeros((len(moving) + 1, STATE.itemsize // 8))
    states.view(STATE)['gap'] = plant.mechanics.rest_gap
    states[range(len(moving)), moving] += shifts
    for state in states:
        advance(law, state.view(np.uint8), int(seat), _NOTHING, _NOTHING, 0.0, step_time)
    after = states[:, moving]
    return float(np.abs(np.linalg.eigvals((after[:-1] - after[-1]).T / shifts)).max())
