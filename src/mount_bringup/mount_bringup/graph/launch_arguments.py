"""The arguments of the launch files, as `ros2 launch ... --show-args` lists them."""

import difflib
from collections.abc import Sequence
from typing import NamedTuple

from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RESTART_LIMIT, SIMULATED
from mount_bringup.settings import SettingError
from mount_control.policy.registry import POLICIES


class LaunchArgument(NamedTuple):
    """An argument of a launch file, and NODE.NAME of the parameters that it sets if it is not empty.

    A parameter of a node that is not in the graph is left out.
    """

    name: str
    meaning: str
    sets: tuple[str, ...] = ()
    default: str = ''
    choices: tuple[str, ...] = ()

    @property
    def description(self) -> str:
        """The meaning, and what an empty text stands for."""
        complete = self.default or not self.sets or 'empty:' in self.meaning
        return self.meaning if complete else f'{self.meaning}; empty: as in the config file'


def texts_of(words: Sequence[str], arguments: Sequence[LaunchArgument]) -> dict[str, str]:
    """Return {argument: text} of words NAME:=TEXT, the rest at their defaults; refuse other words."""
    given = {argument.name: argument.default for argument in arguments}
    for word in words:
        name, assigned, text = word.partition(':=')
        if not assigned or name not in given:
            close = difflib.get_close_matches(name, given, 1)
            hint = f'did you mean {close[0]}:=?' if close else f'known are {", ".join(given)}'
            raise SettingError(f'{word} is no argument of this launch file; {hint}')
        given[name] = text
    return given


POLICY_OF_DAMPER = 'switched_viscous'  # the others compute their force without a given damper
COMMON_ARGUMENTS = (
    LaunchArgument('config', 'parameter file of all nodes; empty: none'),
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
        tuple(f'{node.name}.parameters_file' for node in (DRIVER, INIT, CONTROL)),
    ),
    LaunchArgument(
        'specimen',
        'name that the specimen file must bear; empty: as in the config file, else any',
        tuple(f'{node.name}.specimen' for node in (DRIVER, INIT, CONTROL)),
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
    LaunchArgument(
        'sample_rate',
        'Hz: how often the electronics measure and are answered',
        tuple(f'{node.name}.sample_rate' for node in SIMULATED),
    ),
)
PORT = 'UDP port of the simulated CAN bus; empty: one for each ROS domain and namespace'

VEHICLE_ARGUMENTS = (
    *COMMON_ARGUMENTS,
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
    LaunchArgument('port', f'{PORT}; for interface udp_multicast alone', ('mount_driver.port',)),
    LaunchArgument('duration', 's after which the graph ends; empty: when it is told to end'),
)
"""The arguments of the graph in the car."""
