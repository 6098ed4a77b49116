"""The graph with the simulated car, as the arguments of `sim.launch.py` order it."""

from mount_bringup.graph.launch_arguments import COMMON_ARGUMENTS, PORT, LaunchArgument
from mount_bringup.graph.nodes import SIM, SIMULATED
from mount_bringup.graph.order import LaunchOrder, Settings, Texts, launch_order
from mount_models.quantity import with_flattened
from mount_sim.electronics.faults.schedule import FORM, told_faults
from mount_sim.excitation.building import build_excitation
from mount_sim.excitation.scenario import SCENARIO_NAMES
from mount_sim.mount_choice import check_control_of_mount, with_control_of_mount
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import MOUNTS, seated_mount
from mount_sim.plant.places import mount_names
from mount_sim.plant.simulated_car import SimulatedCar, mount_parameters

SIM_ARGUMENTS = (
    *COMMON_ARGUMENTS,
    LaunchArgument('scenario', f'what is driven: {", ".join(SCENARIO_NAMES)}', ('mount_sim.scenario',)),
    LaunchArgument(
        'excitation',
        'array of a recording or road at the step of the plant, as in given/ of a drive; '
        'with scenario:=recorded or road',
        ('mount_sim.recorded.file', 'mount_sim.road.file'),
    ),
    LaunchArgument('mount', f'what is between engine and chassis: {", ".join(MOUNTS)}', ('mount_sim.mount',)),
    LaunchArgument(
        'duration', 's of excitation, after which the graph ends', ('mount_sim.timeline.duration',)
    ),
    LaunchArgument('port', PORT, ('mount_driver.port', 'mount_sim.port')),
    LaunchArgument('fault', f'faults as {FORM}, with commas between them', ('mount_sim.faults',)),
)
"""The arguments of the graph with the simulated car."""


def sim_order(given: Texts) -> LaunchOrder:
    """Return the graph with the simulated car; a `ValueError` says what cannot be."""
    mount_names(given['mounts'])
    order = launch_order(SIMULATED, SIM_ARGUMENTS, given, '', _checked_mount)
    values = order.settings.parameters[SIM.name]
    sim = mount_parameters(values)
    if values.get('mounts'):
        SimulatedCar(values, build_excitation(sim))
    return order._replace(scenario=sim.scenario)


def _checked_mount(settings: Settings) -> Settings:
    """Return the settings as the mount in the seat needs them; refuse what the simulator cannot work with."""
    settings = with_control_of_mount(settings)
    check_control_of_mount(settings)
    sim = with_flattened(SimParameters(), settings[SIM.name])
    seated_mount(sim.mount)
    told_faults(sim.faults)
    build_excitation(sim)
    return settings
