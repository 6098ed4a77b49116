"""Electronics of all mounts and the engine that rests on them, sample by sample, without bus or clock."""

import zlib
from collections.abc import Mapping
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
    ALONE,
    PLACES,
    check_hold,
    check_support,
    mount_names,
    support_of,
    values_of_mount,
)
from mount_sim.plant.plant import PlantSimulation
from mount_sim.plant.simulated_mount import SimulatedMount


class SimulatedCar:
    """One engine on its mounts in a scenario: each of `mounts` measures and advances, in their order.

    `values` are the parameters {name: value} of mount_sim, with those of single mounts. Where they name no
    mounts there is one alone, under `ALONE`. Raises a `ValueError` for what does not fit together.
    """

    def __init__(self, values: Mapping[str, Any], excitation: Excitation):
        general = mount_parameters(values)
        names = mount_names(general.mounts)
        seat, step_time = excitation.seat, excitation.step_time
        chosen = {name: mount_parameters(values, name) for name in names or (ALONE,)}
        plants = {name: parameters.plant for name, parameters in chosen.items()}
        if names:
            chosen |= {name: mount_parameters(values, name) for name in supported_places(general, names)}
            plants |= {name: _without_electronics(chosen[name], name) for name in chosen if name not in names}
        simulations = {name: PlantSimulation(plant, seat, step_time) for name, plant in plants.items()}
        for plant in plants.values():
            checked_plant(plant, seat, step_time)
        if names:
            supports = {
                name: support_of(getattr(general.places, name), parameters.vehicle)
                for name, parameters in chosen.items()
            }
            if seat is not Seat.BENCH:
                check_hold(general.engine, supports)
            law = CarLaw(checked(general.engine), general.vehicle)
            together = list(simulations.values()), list(supports.values())
            self._plant: CarSimulation | PlantSimulation = CarSimulation(law, *together, seat, step_time)
            check_car(self._plant.memory, seat, step_time)
        else:
            self._plant = simulations[ALONE]
        self._shaking = Shaking(excitation, general.sample_rate)
        self.mounts: dict[str, SimulatedMount] = {}
        for name in names or (ALONE,):
            noise = Noise(general.seed, PLACES.index(name) if name else None)
            seed = general.seed ^ zlib.crc32(name.encode())  # unchanged for a mount alone
            faults = Faults(chosen[name].faults, seed, general.sample_rate)
            self.mounts[name] = SimulatedMount(
                plants[name], simulations[name], noise, self._shaking, faults, self._move
            )

    def _move(self) -> None:
        samples = {mount.sample for mount in self.mounts.values()}
        if len(samples) > 1:
            return  # not all have advanced
        values, forces = self._shaking.at(samples.pop() - 1)
        currents = np.array([mount.current for mount in self.mounts.values()])
        if isinstance(self._plant, CarSimulation):
            self._plant.advance(values, forces, currents)
        else:
            self._plant.advance(values, forces, currents[0])


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
