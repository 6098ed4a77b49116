"""The arguments of the launch files, as `ros2 launch ... --show-args` lists them: one table."""

import difflib
from collections.abc import Sequence
from typing import NamedTuple

from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RESTART_LIMIT, SIMULATED
from mount_bringup.settings import SettingError
from mount_control.policy.registry import POLICIES

GRAPHS = ('vehicle', 'sim')
"""The graphs by the name of their launch file."""
POLICY_OF_DAMPER = 'switched_viscous'  # the others compute their force without a given damper
_SWITCH = ('true', 'false')
_PORT = 'UDP port of the simulated CAN bus; empty: one for each ROS domain and namespace'


class LaunchArgument(NamedTuple):
    """An argument of the launch files of `graphs`.

    `sets` are NODE.NAME of the parameters that it sets if it is not empty; one of a node that is not in the
    graph is left out.
    """

    name: str
    meaning: str
    sets: tuple[str, ...] = ()
    default: str = ''
    choices: tuple[str, ...] = ()
    graphs: tuple[str, ...] = GRAPHS

    @property
    def description(self) -> str:
        """The meaning, and what an empty text stands for."""
        complete = self.default or not self.sets or 'empty:' in self.meaning
        return self.meaning if complete else f'{self.meaning}; empty: as in the config file'


def _of(name: str, *nodes: str) -> tuple[str, ...]:
    return tuple(f'{node}.{name}' for node in nodes)


_OF_MOUNT = (DRIVER.name, INIT.name, CONTROL.name)
_ARGUMENTS = (
    LaunchArgument('config', 'parameter file of all nodes; empty: none'),
    LaunchArgument('namespace', 'where the graph lives, such as mount_right; empty: /'),
    LaunchArgument('mounts', 'mounts with electronics, such as left,right; empty: one, in this namespace'),
    LaunchArgument('record', 'whether the graph records', default='true', choices=_SWITCH),
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
        _of('parameters_file', *_OF_MOUNT),
    ),
    LaunchArgument(
        'specimen',
        'name that the specimen file must bear; empty: as in the config file, else any',
        _of('specimen', *_OF_MOUNT),
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
        choices=_SWITCH,
    ),
    LaunchArgument(
        'restarts',
        'times that a node may be lost within a minute before the graph ends; 0: the first loss ends it',
        default=str(RESTART_LIMIT),
    ),
    LaunchArgument(
        'log_level',
        'lowest level of the log of the nodes',
        default='info',
        choices=('debug', 'info', 'warn', 'error', 'fatal'),
    ),
    LaunchArgument(
        'sample_rate',
        'Hz: how often the electronics measure and are answered',
        _of('sample_rate', *(node.name for node in SIMULATED)),
    ),
    LaunchArgument(
        'interface',
        'interface of python-can; empty: as in the config file, else socketcan',
        ('mount_driver.interface',),
        graphs=('vehicle',),
    ),
    LaunchArgument(
        'channel',
        'channel of the interface; empty: as in the config file, else can0',
        ('mount_driver.channel',),
        graphs=('vehicle',),
    ),
    LaunchArgument(
        'channels',
        'channel of each of several mounts, such as can0,can1; empty: as in the config file',
        graphs=('vehicle',),
    ),
    LaunchArgument(
        'port', f'{_PORT}; for interface udp_multicast alone', ('mount_driver.port',), graphs=('vehicle',)
    ),
    LaunchArgument('duration', 's after which the graph ends; empty: at Ctrl-C', graphs=('vehicle',)),
    LaunchArgument(
        'scenario',
        'what is driven: motorway, bench, sweep, recorded',
        ('mount_sim.scenario',),
        graphs=('sim',),
    ),
    LaunchArgument(
        'mount',
        'what is between engine and chassis: friction, friction_off, friction_always_on, hydro, elastomer',
        ('mount_sim.mount',),
        graphs=('sim',),
    ),
    LaunchArgument(
        'duration',
        's of excitation, after which the graph ends',
        ('mount_sim.timeline.duration',),
        graphs=('sim',),
    ),
    LaunchArgument('port', _PORT, ('mount_driver.port', 'mount_sim.port'), graphs=('sim',)),
    LaunchArgument(
        'fault',
        'faults as NAME@t[:duration], with commas between them',
        ('mount_sim.faults',),
        graphs=('sim',),
    ),
)


def arguments_of(graph: str) -> list[LaunchArgument]:
    """Return the arguments of the launch file of `graph`."""
    return [argument for argument in _ARGUMENTS if graph in argument.graphs]


def texts_of(words: Sequence[str], graph: str) -> dict[str, str]:
    """Return {argument: text} of words NAME:=TEXT, the rest at their defaults; refuse other words."""
    given = {argument.name: argument.default for argument in arguments_of(graph)}
    for word in words:
        name, assigned, text = word.partition(':=')
        if not assigned or name not in given:
            close = difflib.get_close_matches(name, given, 1)
            hint = f'did you mean {close[0]}:=?' if close else f'known are {", ".join(given)}'
            raise SettingError(f'{word} is no argument of this launch file; {hint}')
        given[name] = text
    return given
