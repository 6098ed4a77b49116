"""Electronics of all mounts and the engine that rests on them, sample by sample, without bus or clock."""

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mount_models.arithmetic.record import record_bytes
from mount_models.arrays import FloatArray
from mount_models.quantity import ParameterError, checked, with_flattened
from mount_models.sampling import SAMPLE_RATE, sample_time_ns
from mount_sim.electronics.electronics import Noise, Reading
from mount_sim.electronics.faults import Faults
from mount_sim.excitation.excitation import Excitation, Seat, Shaking
from mount_sim.parameters import SimParameters
from mount_sim.plant.car import CarLaw, CarMemory, advance_car, checked_plant
from mount_sim.plant.engine_body import BODY_STATE, SUPPORT_STATE, Support, check_hold
from mount_sim.plant.mounts import ALONE, PLACES, mount_names, values_of_mount
from mount_sim.plant.plant import Memory, Plant, PlantSimulation
from mount_sim.quantisation import DISPLACEMENT_LIMIT, DISPLACEMENT_STEPS

FARTHEST_DISPLACEMENT = DISPLACEMENT_LIMIT / DISPLACEMENT_STEPS
"""Range of the displacement sensor to either side, m: that of its signal on the bus."""


class DivergedError(ValueError):
    """The simulated plant has no finite state any more; the text says since when and the remedy."""


@dataclass
class BeyondRange:
    """Samples whose displacement lay beyond the sensor's range: sent as not valid, answered with 0 A."""

    samples: int = 0
    first: float = math.nan  # s

    def note(self, time: float) -> None:
        """Take one more, at `time` s."""
        if not self.samples:
            self.first = time
        self.samples += 1


class Run(NamedTuple):
    """Length of a simulated run in samples, where the excitation begins in it, and their rate in Hz."""

    samples: int
    excitation_start: int
    sample_rate: float = SAMPLE_RATE


class Ahead(NamedTuple):
    """What the next n samples are made of.

    The plant, excitation and force on the engine, both (n, steps), whether the coil's driver is open, and
    numbers for the noise (n, `Noise.NUMBERS`).
    """

    memory: Memory
    values: FloatArray
    engine_forces: FloatArray
    driver_open: bool
    noise: FloatArray


class SimulatedMount:
    """One mount in its scenario: `measure` a sample, `advance` to the next with a setpoint, and again.

    A setpoint takes effect at the sample instant after the one that it answers, as the electronics' own
    sampled current loop takes it over. Without a setpoint for `setpoint_timeout`, counted from when the last
    one was due, the current goes to 0 A. `faults` change readings, coil current and plant.
    """

    def __init__(
        self,
        plant: Plant,
        simulation: PlantSimulation,
        noise: Noise,
        shaking: Shaking,
        faults: Faults,
        move: Callable[[], None],
    ):
        """`move` moves plant and car on when all mounts have advanced."""
        self.faults = faults
        self._shaking, self._move, self._noise = shaking, move, noise
        self.run = Run(shaking.samples, shaking.start, shaking.sample_rate)
        self._sound_plant, self._plant = plant, simulation
        self.electronics = plant.electronics
        self.truth = simulation.truth
        """What no sensor saw at the last `measure`."""
        self.sample_rate = shaking.sample_rate
        """Hz"""
        self.sample_time = sample_time_ns(self.sample_rate)
        """ns"""
        self.patience = round(self.electronics.setpoint_timeout * self.sample_rate)
        """Samples without a setpoint after which the current goes to 0 A."""
        self.sample = 0
        self.beyond_range = BeyondRange()
        self.current = 0.0
        """Current (A) of the coil up to the next sample."""
        self._silent = 0
        self._setpoint = 0.0

    @property
    def time(self) -> float:
        """Simulated time in s."""
        return self.sample * (1.0 / self.sample_rate)

    @property
    def finished(self) -> bool:
        """Whether all samples of the run were taken."""
        return self.sample >= self.run.samples

    @property
    def enabled(self) -> bool:
        """Whether setpoints come in time."""
        return self._silent < self.patience

    @property
    def driver_on(self) -> bool:
        """Whether the coil's driver gives what is wanted: setpoints come in time, and it is not open."""
        return self.enabled and not self._driver_open

    @property
    def truth_bytes(self) -> bytes:
        """The same as little-endian float64 numbers in the order of `sim/truth`."""
        return self.truth.tobytes()

    def measure(self) -> Reading:
        """Return what the sensors read now; raises `DivergedError` where the plant has blown up."""
        faults = self.faults
        if faults.due(self.time):
            faults.look(self.time)
            self._plant.change(faults.through('plant', self._sound_plant))
        reading = Reading(*self._plant.read(self._noise.next()))
        if not math.isfinite(reading.displacement):
            raise DivergedError(
                f'the simulated plant has diverged: at {self.time:.3f} s not all of its state is a finite '
                f'number; set the parameters of mount_sim closer to their defaults, or excite it less'
            )
        if abs(reading.displacement) > FARTHEST_DISPLACEMENT:
            self.beyond_range.note(self.time)
        return faults.through('reading', reading) if faults.present else reading

    def forget(self) -> None:
        """Take no setpoint of the past for one of the present, as electronics that were without power."""
        self._silent = self.patience

    def advance(self, setpoint: float | None, late: int = 0) -> None:
        """Go on to the next sample with a new setpoint (A), or None if none has come since the last one.

        `late` is the number of samples since it was due. After the end of the run nothing shakes the mount.
        """
        if setpoint is None:
            self._silent += 1
        else:
            self._silent, self._setpoint = late, setpoint
        current = self._setpoint if self.driver_on else 0.0
        self.current = self.faults.through('current', current) if self.faults.present else current
        self.sample += 1
        self._move()

    def ahead(self, count: int) -> Ahead:
        """Return what the next samples of a mount alone need in a compiled loop; none of them is taken yet.

        They are at least one and at most `count`. The loop does for each what `measure` and `advance` with a
        setpoint do; `skip` notes how far it came.
        """
        until_open = self.run.excitation_start - self.sample
        if self._sound_plant.mount.driver_opens and until_open > 0:
            count = min(count, until_open)
        values, forces = self._shaking.ahead(self.sample, min(count, self.run.samples - self.sample))
        return Ahead(self._plant.memory, values, forces, self._driver_open, self._noise.ahead(len(values)))

    def skip(self, count: int, setpoint: float) -> None:
        """Note that a compiled loop took `count` samples and advanced the last one with `setpoint` (A)."""
        self._noise.skip(count)
        self._silent, self._setpoint = 0, setpoint
        self.sample += count

    @property
    def _driver_open(self) -> bool:
        return self._sound_plant.mount.driver_opens and self.sample >= self.run.excitation_start


class SimulatedCar:
    """One engine on its mounts in a scenario: each of `mounts` measures and advances, in their order.

    `values` are the parameters {name: value} of mount_sim, with those of single mounts. Where they name no
    mounts there is one alone, under `ALONE`. Raises a `ValueError` for what does not fit together.
    """

    def __init__(self, values: Mapping[str, Any], excitation: Excitation):
        general = mount_parameters(values)
        names = mount_names(general.mounts) or (ALONE,)
        chosen = {name: mount_parameters(values, name) for name in names}
        seat, step_time = excitation.seat, excitation.step_time
        self._seat, self._step_time = int(seat), step_time
        self._plants = {name: PlantSimulation(each.plant, seat, step_time) for name, each in chosen.items()}
        for each in chosen.values():
            checked_plant(each.plant, seat, step_time)
        self._memory: CarMemory | None = None
        if ALONE not in chosen:
            if seat is Seat.ACCELERATED_CHASSIS:
                raise ParameterError(
                    f'scenario recorded moves one mount alone; leave out mounts ({general.mounts}), '
                    'or choose another scenario'
                )
            supports = {
                name: Support(*getattr(general.places, name), each.vehicle) for name, each in chosen.items()
            }
            if seat is not Seat.BENCH:
                check_hold(general.engine, supports, step_time)
            self._memory = self._joined(CarLaw(checked(general.engine), general.vehicle), supports)
        self._shaking = Shaking(excitation, general.sample_rate)
        self.mounts: dict[str, SimulatedMount] = {}
        for name, each in chosen.items():
            noise = Noise(general.seed, PLACES.index(name) if name else None)
            seed = general.seed ^ zlib.crc32(name.encode())  # unchanged for a mount alone
            faults = Faults(each.faults, seed, general.sample_rate)
            self.mounts[name] = SimulatedMount(
                each.plant, self._plants[name], noise, self._shaking, faults, self._move
            )

    def _joined(self, law: CarLaw, supports: Mapping[str, Support]) -> CarMemory:
        """Return the memory of the car; each mount's parameters and state are its parts from now on."""
        alone = [plant.memory for plant in self._plants.values()]
        count = len(alone)
        memory = CarMemory(
            record_bytes(law),
            np.concatenate([each.plant for each in alone]),
            np.concatenate([each.state for each in alone]),
            np.concatenate([record_bytes(support) for support in supports.values()]),
            np.zeros(BODY_STATE.itemsize, np.uint8),
            np.zeros(count * SUPPORT_STATE.itemsize, np.uint8),
        )
        parts = np.split(memory.plants, count), np.split(memory.states, count)
        for simulation, plant, state in zip(self._plants.values(), *parts, strict=True):
            simulation.memory = simulation.memory._replace(plant=plant, state=state)
        return memory

    def _move(self) -> None:
        samples = {mount.sample for mount in self.mounts.values()}
        if len(samples) > 1:
            return  # not all have advanced
        values, forces = self._shaking.at(samples.pop() - 1)
        if self._memory is None:
            self._plants[ALONE].advance(values, forces, self.mounts[ALONE].current)
        else:
            currents = np.array([mount.current for mount in self.mounts.values()])
            advance_car(*self._memory, self._seat, values, forces, currents, self._step_time)


def mount_parameters(values: Mapping[str, Any], name: str = '') -> SimParameters:
    """Return the parameters of mount_sim as they hold for the mount `name`, or in general."""
    return with_flattened(SimParameters(), values_of_mount(values, name))


def beyond_range_sentence(samples: int, first: float) -> str:
    """Return what is to be told of displacements beyond the sensor's range, the first at `first` s."""
    limit = 1e3 * FARTHEST_DISPLACEMENT
    return (
        f'the simulated mount moved beyond the {limit:g} mm of its displacement sensor in {samples} samples, '
        f'first at {first:.3f} s; they were sent as not valid and answered with 0 A: excite it less'
    )
