"""The simulated truth of one engine on several mounts in one compiled step."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.engine_body import (
    BODY_STATE,
    SUPPORT,
    SUPPORT_STATE,
    RigidEngine,
    Support,
    accelerated_engine_step,
    car_step,
    support_records,
)
from mount_sim.plant.plant import (
    PLANT,
    STATE,
    PlantSimulation,
    advance,
    advance_magnet,
    force_beside_elastomer,
    take_motion,
)
from mount_sim.plant.vehicle import MountMotion, Vehicle

QUARTERS = 2.0
"""Of the vehicle, `Vehicle` each: the front half of the car, whose two wheels move alike (chosen)."""

_BENCH, _ACCELERATED_CHASSIS = int(Seat.BENCH), int(Seat.ACCELERATED_CHASSIS)


class CarLaw(NamedTuple):
    """What the mounts share."""

    engine: RigidEngine = RigidEngine()
    vehicle: Vehicle = Vehicle()


_CAR = record_dtype(CarLaw)


class CarMemory(NamedTuple):
    """Parameters and state as bytes of records, those of the mounts one behind the other."""

    law: NDArray[np.uint8]  # `CarLaw`
    plants: NDArray[np.uint8]  # `PLANT`
    states: NDArray[np.uint8]  # `STATE`
    supports: NDArray[np.uint8]  # `SUPPORT`
    body: NDArray[np.uint8]  # `BODY_STATE`
    motions: NDArray[np.uint8]  # `SUPPORT_STATE`


class CarSimulation:
    """Mounts, engine and vehicle; of the mounts those with electronics come first.

    `mounts` are the simulations of the single mounts, whose states stand here from now on: each is read by
    itself, and all are advanced together.
    """

    def __init__(
        self,
        law: CarLaw,
        mounts: Sequence[PlantSimulation],
        supports: Sequence[Support],
        seat: Seat,
        step_time: float,
    ):
        self.memory = CarMemory(
            record_bytes(law),
            np.concatenate([mount.memory.plant for mount in mounts]),
            np.concatenate([mount.memory.state for mount in mounts]),
            support_records(supports).view(np.uint8),
            np.zeros(BODY_STATE.itemsize, np.uint8),
            np.zeros(len(supports) * SUPPORT_STATE.itemsize, np.uint8),
        )
        bytes_of_each = (np.split(part, len(mounts)) for part in (self.memory.plants, self.memory.states))
        for mount, plant, state in zip(mounts, *bytes_of_each, strict=True):
            mount.stand_in(plant, state)
        self._seat = int(seat)
        self._step_time = step_time

    def advance(
        self,
        values: NDArray[np.float64],
        engine_forces: NDArray[np.float64],
        wanted_currents: NDArray[np.float64],
    ) -> None:
        """Advance by one step for each of the excitation's `values`, with setpoints (A) of the first mounts.

        `engine_forces` (N, upwards) act on the engine in the same steps; a bench holds the engine.
        """
        advance_car(*self.memory, self._seat, values, engine_forces, wanted_currents, self._step_time)


@compiled
def advance_car(law, plants, states, supports, body, motions, seat, values, engine_forces, wanted, dt):
    """Advance all mounts by one step of `dt` s for each excitation value; see `CarSimulation.advance`."""
    laws, nows, places = plants.view(PLANT), states.view(STATE), supports.view(SUPPORT)
    if seat == _BENCH:
        _advance_benches(plants, states, len(places), values, wanted, dt)
        return
    car, moved, moves = law.view(_CAR)[0], body.view(BODY_STATE)[0], motions.view(SUPPORT_STATE)
    beside = np.zeros(len(places))
    for k in range(len(wanted)):
        nows[k].wanted_current = wanted[k]
    for index in range(len(values)):
        for k in range(len(places)):
            if k < len(wanted):  # without electronics no current flows
                advance_magnet(laws[k], nows[k], dt)
            beside[k] = force_beside_elastomer(laws[k], nows[k], nows[k].displacement, dt)
        value, force = values[index], engine_forces[index]
        if seat == _ACCELERATED_CHASSIS:
            accelerated_engine_step(car.engine, places, moved, moves, value, force, beside, dt)
        else:
            car_step(car.vehicle, QUARTERS, car.engine, places, moved, moves, value, force, beside, dt)
        for k in range(len(places)):
            _take_motion_of(laws[k], nows[k], moves[k], moved, seat, value, dt)


@compiled
def _advance_benches(plants, states, count, values, wanted, dt):
    """Every mount stands on a rack of its own; all racks impose the same displacement."""
    nothing = np.zeros(len(values))
    law, state = len(plants) // count, len(states) // count
    for k in range(count):
        current = wanted[k] if k < len(wanted) else 0.0
        advance(
            plants[k * law : (k + 1) * law],
            states[k * state : (k + 1) * state],
            _BENCH,
            values,
            nothing,
            current,
            dt,
        )


@compiled
def _take_motion_of(law, now, motion, body, seat, value, dt):
    moved = MountMotion(motion.displacement, motion.velocity, motion.mount_force, motion.chassis_acceleration)
    take_motion(law, now, moved, dt)
    if seat != _ACCELERATED_CHASSIS:
        now.road_height = value
        now.vehicle.wheel_height = body.wheel_height
        now.vehicle.chassis_height = motion.chassis_height
        now.vehicle.engine_height = motion.engine_height
