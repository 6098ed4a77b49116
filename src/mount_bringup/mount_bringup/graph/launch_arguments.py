"""The arguments of the launch files: what `ros2 launch ... --show-args` tells."""

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mount_bringup.graph.nodes import RESTART_LIMIT, SIMULATED, VEHICLE, GraphNode
from mount_bringup.settings import SettingError
from mount_control.policy.registry import POLICIES
from mount_sim.electronics.faults.schedule import FORM
from mount_sim.plant.mounts import MOUNTS

_OF_SPECIMEN = ('mount_driver', 'mount_init', 'mount_control')
"""The nodes that load the specimen file."""


class LaunchArgument(NamedTuple):
    """An argument of a launch file, and NODE.NAME of the parameters that it sets if it is not empty."""

    name: str
    meaning: str
    sets: tuple[str, ...] = ()
    default: str = ''
    choices: tuple[str, ...] = ()

    @property
    def description(self) -> str:
        """The meaning, and what an empty text stands for."""
        told = self.default or not self.sets or 'empty:' in self.meaning
        return self.meaning if told else f'{self.meaning}; empty: as in the config file'


_FILES = ('sim.launch.py', 'vehicle.launch.py', 'replay.launch.py')


def check_arguments(command: Sequence[str], arguments: Sequence[LaunchArgument]) -> None:
    """Raise `SettingError` for a NAME:=TEXT in the `command` that is no argument of its launch file.

    Where another launch file includes ours, the arguments are for both, and nothing is told of them.
    """
    if not any(Path(word).name in _FILES for word in command):
        return
    known = [argument.name for argument in arguments]
    for name in (word.partition(':=')[0] for word in command if ':=' in word):
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            meant = f'did you mean {close[0]}:=?' if close else '--show-args tells which there are'
            raise SettingError(f'{name}:= is no argument of this launch file; {meant}')


POLICY_OF_DAMPER = 'switched_viscous'  # the others compute their force without a given damper
_ANY = (
    LaunchArgument('namespace', 'where the graph lives, such as mount_right; empty: /'),
    LaunchArgument('mounts', 'mounts with electronics, such as left,right; empty: one, in this namespace'),
    LaunchArgument('record', 'whether the graph records', default='true', choices=('true', 'false')),
    LaunchArgument(
        'recording',
        'folder that the recording creates; empty: only with record:=false',
        ('mount_recorder.uri',),
    ),
    LaunchArgument('policy', f'how forces are chosen: {", ".join(POLICIES)}', ('mount_control.policy',)),
    LaunchArgument(
        'damper', f'damper of policy {POLICY_OF_DAMPER}, such as viscous_2000', ('mount_control.damper',)
    ),
    LaunchArgument(
        'parameters_file',
        'specimen file of this actuator; empty: as in the config file, else the shipped one',
        tuple(f'{node}.parameters_file' for node in _OF_SPECIMEN),
    ),
    LaunchArgument(
        'specimen',
        'name that the specimen file must bear; empty: as in the config file, else any',
        tuple(f'{node}.specimen' for node in _OF_SPECIMEN),
    ),
    LaunchArgument(
        'priority',
        'real-time priority (SCHED_FIFO, 1 .. 98) of the loop, half of it for the recorder; 0: none',
        default='0',
    ),
    LaunchArgument(
        'composed',
        'true: driver, initialisation and control of the mount share a process',
        default='false',
        choices=('true', 'false'),
    ),
    LaunchArgument(
        'restarts',
        'times that a node may be lost within a minute before the graph ends; 0: the first loss ends it',
        default=str(RESTART_LIMIT),
    ),
    LaunchArgument(
        'log_level',
        'what the nodes say at least',
        default='info',
        choices=('debug', 'info', 'warn', 'error', 'fatal'),
    ),
)


def _sample_rate(nodes: Sequence[GraphNode]) -> LaunchArgument:
    return LaunchArgument(
        'sample_rate',
        'Hz: how often the electronics measure and are answered',
        tuple(f'{node.name}.sample_rate' for node in nodes),
    )


_PORT = 'UDP port of the simulated CAN bus; empty: one for each ROS domain and namespace'

SIM_ARGUMENTS = (
    *_ANY,
    _sample_rate(SIMULATED),
    LaunchArgument('scenario', 'what is driven: motorway, bench, sweep, recorded', ('mount_sim.scenario',)),
    LaunchArgument('mount', f'what is between engine and chassis: {", ".join(MOUNTS)}', ('mount_sim.mount',)),
    LaunchArgument(
        'duration', 's of excitation, after which the graph ends', ('mount_sim.timeline.duration',)
    ),
    LaunchArgument('port', _PORT, ('mount_driver.port', 'mount_sim.port')),
    LaunchArgument('fault', f'faults as {FORM}, with commas between them', ('mount_sim.faults',)),
)
"""The arguments of the graph with the simulated car, besides `config`."""

VEHICLE_ARGUMENTS = (
    *_ANY,
    _sample_rate(VEHICLE),
    LaunchArgument(
        'interface',
        'interface of python-can; empty: as in the config file, else socketcan',
        ('mount_driver.interface',),
    ),
    LaunchArgument(
        'channel',
        'channel of the interface; empty: as in the config file, else can0',
        ('mount_driver.channel',),
    ),
    LaunchArgument(
        'channels', 'channel of each of several mounts, such as can0,can1; empty: as in the config file'
    ),
    LaunchArgument('port', f'{_PORT}; for interface udp_multicast alone', ('mount_driver.port',)),
    LaunchArgument('duration', 's after which the graph ends; empty: when it is told to end'),
)
"""The arguments of the graph in the car, besides `config`."""

_OF_RECORDED = ('policy', 'damper', 'parameters_file', 'specimen')
_OF_REPLAY = ('record', 'recording', 'priority', 'log_level')

REPLAY_ARGUMENTS = (
    LaunchArgument('bag', 'recorded drive that is played to the control: its folder; must be given'),
    LaunchArgument(
        'config', 'parameter file; what neither it nor an argument sets is as recorded; empty: none'
    ),
    LaunchArgument(
        'namespace',
        'mount of the recorded drive, and where it is replayed, such as mount_right; empty: its only one',
    ),
    LaunchArgument('rate', 'how fast it is played; 1: as fast as it was recorded', default='1'),
    *(
        argument._replace(meaning=f'{argument.meaning.partition("; empty:")[0]}; empty: as recorded')
        for argument in _ANY
        if argument.name in _OF_RECORDED
    ),
    *(argument for argument in _ANY if argument.name in _OF_REPLAY),
)
"""The arguments of a replay."""
