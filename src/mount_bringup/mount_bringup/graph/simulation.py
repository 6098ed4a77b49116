"""Checks of a simulated graph before its simulator starts; a `ValueError` says what cannot be."""

from collections.abc import Mapping
from typing import Any

from mount_models.quantity import with_flattened
from mount_sim.electronics.faults.schedule import told_faults
from mount_sim.excitation.building import build_excitation
from mount_sim.mount_choice import check_control_of_mount, with_control_of_mount
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seated_mount
from mount_sim.plant.places import mount_names as mount_names
from mount_sim.plant.simulated_car import SimulatedCar, mount_parameters

Settings = Mapping[str, Mapping[str, Any]]


def with_checked_mount(settings: Settings) -> dict[str, dict[str, Any]]:
    """Return the settings of a mount, with those that the mount in the seat needs."""
    completed = with_control_of_mount(settings)
    check_control_of_mount(completed)
    sim = with_flattened(SimParameters(), completed['mount_sim'])
    seated_mount(sim.mount)
    told_faults(sim.faults)
    build_excitation(sim)
    return completed


def checked_scenario(values: Mapping[str, Any]) -> str:
    """Return the scenario of the simulator's parameters; several mounts must hold an engine."""
    sim = mount_parameters(values)
    if values.get('mounts'):
        SimulatedCar(values, build_excitation(sim))
    return sim.scenario
