"""The arguments of the launch files, as `ros2 launch ... --show-args` lists them: one table."""

import difflib
from collections.abc import Sequence
from typing import NamedTuple

from mount_bringup.graph.nodes import RESTART_LIMIT
from mount_bringup.settings import SettingError
from mount_control.policy.registry import POLICIES

POLICY_OF_DAMPER = 'switched_viscous'  # the others compute their force without a given damper
_PORT = 'UDP port of the simulated CAN bus; empty: one for each ROS domain and namespace'


class LaunchArgument(NamedTuple):
    """An argument of a launch file; `choices` has a word for each text that it may have.

    `sets` are NODE.NAME of the parameters that it sets if it is not empty; one of a node that is not in the
    graph is left out.
    """

    name: str
    meaning: str
    sets: str = ''
    default: str = ''
    choices: str = ''

    @property
    def description(self) -> str:
        """The meaning, and what an empty text stands for."""
        complete = self.default or not self.sets or 'empty:' in self.meaning
        return self.meaning if complete else f'{self.meaning}; empty: as in the config file'


_COMMON = (
    ('config', 'parameter file of all nodes; empty: none'),
    ('namespace', 'where the graph lives, such as mount_right; empty: /'),
    ('mounts', 'mounts with electronics, such as left,right; empty: one, in this namespace'),
    ('record', 'whether the graph records', '', 'true', 'true false'),
    ('recording', 'folder that the recording creates; empty: only with record:=false', 'mount_recorder.uri'),
    ('policy', f'how forces are chosen: {", ".join(POLICIES)}', 'mount_control.policy'),
    ('damper', f'damper of policy {POLICY_OF_DAMPER}, such as viscous_2000', 'mount_control.damper'),
    (
        'parameters_file',
        'specimen file of this actuator; empty: as in the config file, else the shipped one',
        'mount_driver.parameters_file mount_init.parameters_file mount_control.parameters_file',
    ),
    (
        'specimen',
        'name that the specimen file must bear; empty: as in the config file, else any',
        'mount_driver.specimen mount_init.specimen mount_control.specimen',
    ),
    (
        'priority',
        'real-time priority (SCHED_FIFO, 1 .. 98) of the loop, half of it for the recorder; 0: none',
        '',
        '0',
    ),
    (
        'composed',
        'true: driver, initialisation and control of the mount share a process',
        '',
        'false',
        'true false',
    ),
    (
        'restarts',
        'times that a node may be lost within a minute before the graph ends; 0: the first loss ends it',
        '',
        str(RESTART_LIMIT),
    ),
    ('log_level', 'lowest level of the log of the nodes', '', 'info', 'debug info warn error fatal'),
    (
        'sample_rate',
        'Hz: how often the electronics measure and are answered',
        'mount_recorder.sample_rate mount_driver.sample_rate mount_sim.sample_rate mount_init.sample_rate '
        'mount_control.sample_rate',
    ),
)
_OWN = {
    'vehicle': (
        (
            'interface',
            'interface of python-can; empty: as in the config file, else socketcan',
            'mount_driver.interface',
        ),
        (
            'channel',
            'channel of the interface; empty: as in the config file, else can0',
            'mount_driver.channel',
        ),
        ('channels', 'channel of each of several mounts, such as can0,can1; empty: as in the config file'),
        ('port', f'{_PORT}; for interface udp_multicast alone', 'mount_driver.port'),
        ('duration', 's after which the graph ends; empty: at Ctrl-C'),
    ),
    'sim': (
        ('scenario', 'what is driven: motorway, bench, sweep, recorded, road', 'mount_sim.scenario'),
        (
            'excitation',
            'array of a recording or road at the step of the plant, as in given/ of a drive; '
            'with scenario:=recorded or road',
            'mount_sim.recorded.file mount_sim.road.file',
        ),
        (
            'mount',
            'between engine and chassis: friction, friction_off, friction_always_on, hydro, elastomer',
            'mount_sim.mount',
        ),
        ('duration', 's of excitation, after which the graph ends', 'mount_sim.timeline.duration'),
        ('port', _PORT, 'mount_driver.port mount_sim.port'),
        ('fault', 'faults as NAME@t[:duration], with commas between them', 'mount_sim.faults'),
    ),
}
GRAPHS = tuple(_OWN)
"""The graphs by the name of their launch file."""


def arguments_of(graph: str) -> list[LaunchArgument]:
    """Return the arguments of the launch file of `graph`."""
    return [LaunchArgument(*row) for row in (*_COMMON, *_OWN[graph])]


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
