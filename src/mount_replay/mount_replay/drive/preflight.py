"""Refuses an order that a node would refuse, before any node is started."""

from mount_bags.recorder.parameters import RecorderParameters
from mount_bringup.chosen import Parameters
from mount_bringup.mount_choice import check_control_of_mount
from mount_bringup.sample_rate import check_sample_rate
from mount_control.settings import check_effect
from mount_driver.parameters import DriverParameters
from mount_models.actuator.closing import checked_closing
from mount_models.quantity import with_flattened
from mount_replay.drive.recorder_options import checked_recorder
from mount_replay.loop.chain import CoreChain
from mount_sim.electronics.faults import Fault
from mount_sim.excitation.excitation import Excitation
from mount_sim.excitation.scenario import build_excitation
from mount_sim.excitation.shaking import steps_of_sample
from mount_sim.parameters import SimParameters
from mount_sim.plant.check import checked_plant


def preflight(parameters: Parameters) -> Excitation:
    """Return the excitation of a run, or raise the `ValueError` that says what is wrong with the order."""
    sim = with_flattened(SimParameters(), parameters.get('mount_sim', {}))
    excitation = build_excitation(sim)
    steps_of_sample(sim.sample_rate, excitation.step_time)
    Fault(sim.fault)
    check_sample_rate(parameters)
    check_control_of_mount(parameters)
    check_effect(parameters.get('mount_control', {}))
    checked_closing(sim.mechanics, sim.actuator)
    checked_plant(sim.plant, excitation.seat, excitation.step_time)
    with_flattened(DriverParameters(), parameters.get('mount_driver', {}))
    checked_recorder(RecorderParameters(), parameters.get('mount_recorder', {}))
    CoreChain(parameters)
    return excitation
