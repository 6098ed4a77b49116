"""The simulated truth in one compiled step: coil, actuator, the mount, and what moves around them."""

from typing import NamedTuple

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import number_record, record_bytes, record_dtype, record_type
from mount_models.arrays import ByteArray, FloatArray
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import checked
from mount_ros.topics import SIM_TRUTH
from mount_sim.electronics.electronics import ElectronicsParameters, advance_current, read_sensors
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.closing import ClosingMechanics, checked_closing, closed_state
from mount_sim.plant.friction import full_step
from mount_sim.plant.hydromount import HYDROMOUNT_STATE, Hydromount, hydromount_force, hydromount_step
from mount_sim.plant.mounts import Contents, SeatedMount
from mount_sim.plant.reluctance import ReluctanceActuator, gap_flux_density
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients, coil_at
from mount_sim.plant.vehicle import (
    BRANCHES,
    ENGINE_STATE,
    VEHICLE_STATE,
    Vehicle,
    elastomer_force,
    engine_step,
    stretch_branches,
    vehicle_step,
)

_PADS, _FLUID = int(Contents.PADS), int(Contents.FLUID)
_BENCH, _ACCELERATED_CHASSIS = int(Seat.BENCH), int(Seat.ACCELERATED_CHASSIS)


class Plant(NamedTuple):
    """All parameters of the simulated truth; none of them is known to the controller."""

    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()
    temperature: TemperatureCoefficients = TemperatureCoefficients()
    mechanics: ClosingMechanics = ClosingMechanics()
    friction: FrictionCoefficients = FrictionCoefficients()
    contact: FrictionContact = FrictionContact()
    vehicle: Vehicle = Vehicle()
    electronics: ElectronicsParameters = ElectronicsParameters()
    hydromount: Hydromount = Hydromount()
    mount: SeatedMount = SeatedMount()


PLANT = record_dtype(Plant)
"""The plant's parameters in compiled code."""

_NUMBERS = (
    'current', 'wanted_current', 'gap', 'normal_force', 'slider_position', 'deflection', 'displacement',
    'velocity', *BRANCHES, 'friction_force', 'mount_force', 'chassis_acceleration', 'road_height',
)  # fmt: skip
STATE = record_type(
    [
        ('vehicle', VEHICLE_STATE),
        ('engine', ENGINE_STATE),
        ('hydromount', HYDROMOUNT_STATE),
        *((name, 'f8') for name in _NUMBERS),
    ]
)
"""What the plant remembers from step to step, SI."""

TRUTH = number_record(*SIM_TRUTH.names)
"""What no sensor sees, SI: the scalars of the topic `sim/truth` in its order."""


class Memory(NamedTuple):
    """Bytes of parameters and state, the seat's number, step of the plant in s."""

    plant: ByteArray
    state: ByteArray
    seat: int
    step_time: float


class PlantSimulation:
    """The plant with its state; `read` looks at it, `advance` moves it on by some steps."""

    def __init__(self, plant: Plant, seat: Seat, step_time: float):
        plant = Plant(*(checked(part) for part in plant))
        checked_closing(plant.mechanics, plant.actuator)
        self.memory = Memory(
            record_bytes(_warm(plant)), np.zeros(STATE.itemsize, np.uint8), int(seat), step_time
        )
        """What the compiled `read` and `advance` need, for a compiled loop that calls them."""
        self.memory.state.view(STATE)['gap'] = plant.mechanics.rest_gap
        self._truth = np.zeros(1, TRUTH).view(np.uint8)
        self.truth = self._truth.view(TRUTH)[0]
        """The truth at the last `read`."""

    def read(self, noise: FloatArray) -> tuple[float, float, float, float]:
        """Return the sensors' readings (displacement, current, di/dt, dB/dt; SI) and note the truth."""
        return read(self.memory.plant, self.memory.state, self._truth, noise)

    def advance(self, values: FloatArray, engine_forces: FloatArray, wanted_current: float) -> None:
        """Advance by one step for each of the excitation's `values`, with a current setpoint in A.

        `engine_forces` (N, upwards) act on the engine in the same steps; a bench holds the engine.
        """
        plant, state, seat, step_time = self.memory
        advance(plant, state, seat, values, engine_forces, wanted_current, step_time)

    def change(self, plant: Plant) -> None:
        """Go on from the present state with other parameters; a fault's need not lie within their ranges."""
        self.memory.plant[:] = record_bytes(_warm(plant))


def _warm(plant: Plant) -> Plant:
    """Return the plant with coil and core at their temperature."""
    celsius = plant.electronics.coil_temperature
    return plant._replace(coil=coil_at(plant.coil, plant.temperature, celsius))


@compiled
def read(plant, state, truth, noise):
    """Return sensor readings and fill `truth`; arguments are the bytes of records, `noise` as in `Noise`.

    The displacement is NaN where anything of the state is no finite number.
    """
    law, now, seen = plant.view(PLANT)[0], state.view(STATE)[0], truth.view(TRUTH)[0]
    seen.displacement = now.displacement
    seen.velocity = now.velocity
    seen.coil_current = now.current
    seen.current_setpoint = now.wanted_current
    seen.gap = now.gap
    seen.flux_density = gap_flux_density(law.actuator, now.current, now.gap)
    seen.normal_force = now.normal_force
    seen.friction_force = now.friction_force
    seen.mount_force = now.mount_force
    seen.road_height = now.road_height
    seen.engine_displacement = now.vehicle.engine_height
    seen.chassis_displacement = now.vehicle.chassis_height
    seen.chassis_acceleration = now.chassis_acceleration
    seen.rest_gap = law.mechanics.rest_gap
    seen.contact_gap = law.mechanics.contact_gap
    seen.setpoint_latency = np.nan
    displacement = now.displacement if _finite(now) else np.nan
    return read_sensors(
        law.electronics, law.coil, law.actuator, displacement, now.velocity, now.current, now.gap, noise
    )


@compiled
def _finite(now):
    motion = now.displacement + now.velocity + now.chassis_acceleration + now.vehicle.wheel_height
    forces = now.mount_force + now.friction_force + now.normal_force + now.deflection
    return np.isfinite(motion + forces + now.current + now.gap)


@compiled
def advance(plant, state, seat, values, engine_forces, wanted_current, dt):
    """Advance the state by one step of `dt` s for each excitation value; see `PlantSimulation.advance`."""
    law, now = plant.view(PLANT)[0], state.view(STATE)[0]
    now.wanted_current = wanted_current
    for index in range(len(values)):
        advance_magnet(law, now, dt)
        if seat == _BENCH:
            advance_bench(law, now, values[index], dt)
            continue
        value, force = values[index], engine_forces[index]
        beside = force_beside_elastomer(law, now, now.displacement, dt)
        if seat == _ACCELERATED_CHASSIS:
            motion = engine_step(law.vehicle, now.engine, value, force, beside, dt)
        else:
            now.road_height = value
            motion = vehicle_step(law.vehicle, now.vehicle, value, force, beside, dt)
        take_motion(law, now, motion, dt)


@compiled
def advance_magnet(law, now, dt):
    """Advance current, gap and normal force by `dt` s."""
    now.current = advance_current(
        law.electronics, law.coil, law.actuator, now.current, now.gap, now.wanted_current, dt
    )
    gap, normal_force = closed_state(law.mechanics, law.actuator, now.current, now.gap)
    now.gap = gap
    now.normal_force = normal_force


@compiled
def force_beside_elastomer(law, now, displacement, dt):
    """Return the force (N) of what acts in the mount at `displacement` (m) beside its elastomer."""
    if law.mount.contents == _PADS:
        now.friction_force, now.slider_position, now.deflection, _ = full_step(
            law.contact, law.friction, now.slider_position, now.deflection, displacement, now.normal_force, dt
        )
        return now.friction_force
    if law.mount.contents == _FLUID:
        return hydromount_force(law.hydromount, now.hydromount)
    return 0.0


@compiled
def advance_bench(law, now, displacement, dt):
    """The rack imposes the displacement; the mount answers with its force."""
    elastomer = law.vehicle.elastomer
    change = displacement - now.displacement
    stretch_branches(elastomer, now, change, dt)
    now.velocity = change / dt
    now.displacement = displacement
    _pump(law, now, change, dt)
    beside = force_beside_elastomer(law, now, displacement, dt)
    now.mount_force = elastomer_force(elastomer, displacement, now) + beside


@compiled
def take_motion(law, now, motion, dt):
    """Note a `MountMotion` and advance what it pumps."""
    _pump(law, now, motion.displacement - now.displacement, dt)
    now.displacement = motion.displacement
    now.velocity = motion.velocity
    now.mount_force = motion.mount_force
    now.chassis_acceleration = motion.chassis_acceleration


@compiled
def _pump(law, now, displacement_change, dt):
    if law.mount.contents == _FLUID:
        hydromount_step(law.hydromount, now.hydromount, displacement_change, dt)
