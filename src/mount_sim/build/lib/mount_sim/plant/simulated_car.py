"""Electronics of several mounts and the engine that rests on them, sample by sample, without bus or clock."""

import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mount_models.quantity import checked, with_flattened
from mount_sim.electronics.electronics import Noise
from mount_sim.electronics.faults.schedule import Faults
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.shaking import Shaking
from mount_sim.parameters import SimParameters
from mount_sim.plant.car import CarLaw, CarSimulation
from mount_sim.plant.car_check import check_car
from mount_sim.plant.check import checked_plant
from mount_sim.plant.mounts import seated_mount
from mount_sim.plant.places import (
    PLACES,
    check_hold,
    check_support,
    mount_names,
    support_of,
    values_of_mount,
)
from mount_sim.plant.plant import PlantSimulation
from mount_sim.plant.simulated_mount import MountElectronics, Run


class CarMount(MountElectronics):
    """One of the mounts of a car; the car moves on when all of them have advanced."""

    def __init__(self, move: Callable[[], None], *arguments: Any):
        super().__init__(*arguments)
        self._move = move
        self.current = 0.0
        """What the coil is given up to the next sample, A."""

    def advance(self, setpoint: float | None, late: int = 0) -> None:
        """Go on to the next sample with a new setpoint (A), or None; as `SimulatedMount.advance`."""
        self.current = self.wanted(setpoint, late)
        self.sample += 1
        self._move()


class SimulatedCar:
    """One engine on several mounts in a scenario: each of `mounts` measures and advances, in their order.

    `values` are the parameters {name: value} of mount_sim, with those of single mounts. Raises a `ValueError`
    for what does not fit together.
    """

    def __init__(self, values: Mapping[str, Any], excitation: Excitation):
        general = mount_parameters(values)
        names = mount_names(general.mounts)
        seat, step_time = excitation.seat, excitation.step_time
        chosen = {name: mount_parameters(values, name) for name in names}
        plants = {name: parameters.plant for name, parameters in chosen.items()}
        chosen |= {name: mount_parameters(values, name) for name in supported_places(general, names)}
        plants |= {name: _without_electronics(chosen[name], name) for name in chosen if name not in names}
        supports = {
            name: support_of(getattr(general.places, name), parameters.vehicle)
            for name, parameters in chosen.items()
        }
        if seat is not Seat.BENCH:
            check_hold(general.engine, supports)
        simulations = {name: PlantSimulation(plant, seat, step_time) for name, plant in plants.items()}
        for plant in plants.values():
            checked_plant(plant, seat, step_time)
        law = CarLaw(checked(general.engine), general.vehicle)
        self._car = CarSimulation(law, list(simulations.values()), list(supports.values()), seat, step_time)
        check_car(self._car.memory, seat, step_time)
        self._shaking = Shaking(excitation, general.sample_rate)
        self._sample = 0
        run = Run(self._shaking.samples, self._shaking.start, general.sample_rate)
        self.mounts: dict[str, CarMount] = {}
        for name in names:
            noise = Noise(general.seed, PLACES.index(name))
            seed = general.seed ^ zlib.crc32(name.encode())
            faults = Faults(chosen[name].faults, seed, general.sample_rate)
            self.mounts[name] = CarMount(self._move, plants[name], simulations[name], noise, run, faults)
        self._currents = np.zeros(len(names))

    def _move(self) -> None:
        if any(mount.sample <= self._sample for mount in self.mounts.values()):
            return
        for place, mount in enumerate(self.mounts.values()):
            self._currents[place] = mount.current
        values, forces = self._shaking.at(self._sample)
        self._car.advance(values, forces, self._currents)
        self._sample += 1


def mount_parameters(values: Mapping[str, Any], name: str = '') -> SimParameters:
    """Return the parameters of mount_sim as they hold for the mount `name`, or in general."""
    return with_flattened(SimParameters(), values_of_mount(values, name))


def supported_places(parameters: SimParameters, mounts: tuple[str, ...]) -> list[str]:
    """Return the places with a support without electronics."""
    supports = {name: check_support(name, getattr(parameters.places, name).support) for name in PLACES}
    return [name for name, support in supports.items() if name not in mounts and support != 'none']


def _without_electronics(parameters: SimParameters, name: str):
    support = getattr(parameters.places, name).support
    return parameters.plant._replace(mount=seated_mount(support))
