"""Refuses an order that a node would refuse, before any node is started."""

from engine_mount.drives.loop.chain import CoreChain
from engine_mount.drives.recorder_options import checked_recorder
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.mounts import mounts_of, settings_of_mounts
from engine_mount.signals.excitation import build_excitation
from mount_bringup.settings import check_sample_rate
from mount_control.settings import check_effect
from mount_driver.parameters import DriverParameters
from mount_models.quantity import with_flattened
from mount_recorder.parameters import RecorderParameters
from mount_sim.electronics.faults.schedule import check_without_bus, told_faults
from mount_sim.excitation.excitation import Excitation, steps_of_sample
from mount_sim.mount_choice import check_control_of_mount
from mount_sim.parameters import SimParameters
from mount_sim.plant.check import checked_plant
from mount_sim.plant.closing import checked_closing
from mount_sim.plant.simulated_car import SimulatedCar, mount_parameters


def preflight(parameters: Parameters, *, core: bool = False) -> Excitation:
    """Return the excitation of a run, or raise the `ValueError` that says what is wrong with the order."""
    values = parameters.get('mount_sim', {})
    excitation = build_excitation(mount_parameters(values))
    for settings in settings_of_mounts(parameters).values():
        _check_mount(settings, excitation, core=core)
    if mounts_of(parameters):
        SimulatedCar(values, excitation)
    checked_recorder(RecorderParameters(), parameters.get('mount_recorder', {}))
    return excitation


def _check_mount(parameters: Parameters, excitation: Excitation, *, core: bool) -> None:
    """Refuse what one mount cannot work with."""
    sim = with_flattened(SimParameters(), parameters.get('mount_sim', {}))
    told_faults(sim.faults)
    if core:
        check_without_bus(sim.faults)
    check_sample_rate(parameters)
    steps_of_sample(sim.sample_rate, excitation.step_time)
    check_control_of_mount(parameters)
    check_effect(parameters.get('mount_control', {}))
    checked_closing(sim.mechanics, sim.actuator)
    checked_plant(sim.plant, excitation.seat, excitation.step_time)
    with_flattened(DriverParameters(), parameters.get('mount_driver', {}))
    CoreChain(parameters)
