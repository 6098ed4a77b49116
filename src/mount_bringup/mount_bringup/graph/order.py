"""The arguments of the launch files, and the graph that they order; `ros2 launch` is not needed here."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mount_bringup.graph.domain import can_port, chosen_domain
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    RECORDER,
    RESTART_LIMIT,
    SIM,
    SIMULATED,
    VEHICLE,
    GraphNode,
    GraphSettings,
    Grouping,
    name_in,
    of_mounts,
)
from mount_bringup.parameter_file import settings_of_file
from mount_bringup.settings import (
    SettingError,
    check_sample_rate,
    checked_settings,
    defaults_of_nodes,
    settings_of_mount,
)
from mount_control.policy.registry import DEFAULT, POLICIES
from mount_driver.parameters import DriverParameters
from mount_models.quantity import check_name, nearest
from mount_ros.nodes.real_time import HIGHEST

_CAN_OF_VEHICLE = {'interface': 'socketcan', 'channel': 'can0'}
POLICY_OF_DAMPER = 'switched_viscous'  # the others compute their force without a given damper


class LaunchArgument(NamedTuple):
    """An argument of a launch file; `choices` has a word for each text that it may have.

    If it is not empty it sets the parameters `sets` of each node that has them, by default that of its name.
    """

    name: str
    meaning: str
    default: str = ''
    choices: str = ''
    sets: str = ''


_COMMON = (
    ('config', 'parameter file of all nodes; empty: none'),
    ('namespace', 'where the graph lives, such as mount_right; empty: /'),
    ('mounts', 'mounts with electronics, such as left,right; empty: one, in this namespace'),
    ('record', 'whether the graph records', 'true', 'true false'),
    ('recording', 'folder that the recording creates; empty: only with record:=false', '', '', 'uri'),
    ('policy', f'how forces are chosen: {", ".join(POLICIES)}; empty: as in the config file'),
    (
        'damper',
        f'damper of policy {POLICY_OF_DAMPER}, such as viscous_2000; empty: as in the config file',
    ),
    (
        'parameters_file',
        'specimen file of this actuator; empty: as in the config file, else the shipped one',
    ),
    ('specimen', 'name that the specimen file must bear; empty: as in the config file, else any'),
    (
        'priority',
        'real-time priority (SCHED_FIFO, 1 .. 98) of the loop, half of it for the recorder; 0: none',
        '0',
    ),
    (
        'composed',
        'true: driver, initialisation and control of the mount share a process',
        'false',
        'true false',
    ),
    (
        'restarts',
        'times that a node may be lost within a minute before the graph ends; 0: the first loss ends it',
        str(RESTART_LIMIT),
    ),
    ('log_level', 'lowest level of the log of the nodes', 'info', 'debug info warn error fatal'),
    ('sample_rate', 'Hz: how often the electronics measure and are answered; empty: as in the config file'),
    ('use_sim_time', 'true: no effect but a warning of each node, which needs no /clock'),
)
_OWN = {
    'vehicle': (
        ('interface', 'interface of python-can; empty: as in the config file, else socketcan'),
        ('channel', 'channel of the interface, of one mount; empty: as in the config file, else can0'),
    ),
    'sim': (
        (
            'scenario',
            'what is driven: motorway, bench, sweep, recorded, road; empty: as in the config file',
        ),
        (
            'excitation',
            'array of a recording or road at the step of the plant, as in given/ of a drive; '
            'with scenario:=recorded or road; empty: as in the config file',
            '',
            '',
            'recorded.file road.file',
        ),
        (
            'mount',
            'between engine and chassis; empty: as in the config file, else friction; one of: '
            'friction, friction_off, friction_always_on, hydro, elastomer',
        ),
        (
            'duration',
            's of excitation, after which the graph ends; empty: as in the config file',
            '',
            '',
            'timeline.duration',
        ),
        (
            'fault',
            'faults as NAME@t[:duration], with commas between them; empty: as in the config file',
            '',
            '',
            'faults',
        ),
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
        check_name(f'{graph}.launch.py', name if assigned else word, given)
        given[name] = text
    return given


class LaunchOrder(NamedTuple):
    """A graph as ordered by the arguments of a launch file."""

    nodes: tuple[GraphNode, ...]
    settings: GraphSettings


def launch_order(command: Sequence[str]) -> LaunchOrder:
    """Return the graph of a command line, its name and NAME:=TEXT; a `ValueError` says what cannot be.

    Names, types and what must fit together are checked here; the range of a value is checked by its node.
    """
    graph, *words = command or ['']
    if graph not in GRAPHS:
        raise SettingError(f'graph {graph!r} is unknown; {nearest(graph, GRAPHS)}')
    given = texts_of(words, graph)
    nodes = SIMULATED if graph == 'sim' else VEHICLE
    namespace, domain = given['namespace'].strip('/'), chosen_domain(None)
    mounts, known = _mount_names(given['mounts']), _known_parameters(nodes)
    given['mounts'] = ','.join(mounts)
    if SIM in nodes:  # not in the car
        from mount_sim.plant.mounts import check_control_of_mount, mount_names, with_control_of_mount

        mount_names(given['mounts'])
    settings: dict[str, dict[str, Any]] = {}
    for node in of_mounts(nodes, mounts):
        space = name_in(namespace, node.mount)
        own = settings_of_file(Path(given['config']), space, known) if given['config'] else {}
        bus: dict[str, Any] = {'port': can_port(domain, space)} if node.is_a(DRIVER, SIM) else {}
        if node.is_a(DRIVER) and SIM not in nodes:
            bus |= _CAN_OF_VEHICLE
        settings[node.full_name] = (
            bus | own.get(node.name, {}) | _of_arguments(graph, given, known[node.name])
        )
    if mounts:
        _separate_buses(mounts, settings)
    settings = checked_settings(settings, known)
    for mount in mounts or ('',):
        of_mount = settings_of_mount(settings, mount)
        if SIM in nodes:
            of_mount = with_control_of_mount(of_mount)
            check_control_of_mount(of_mount)
            settings[name_in(mount, CONTROL.name)] = of_mount.get(CONTROL.name, {})
        check_sample_rate(of_mount, known)
        policy = of_mount.get(CONTROL.name, {}).get('policy', DEFAULT)
        if given['damper'] and policy != POLICY_OF_DAMPER:
            raise SettingError(
                f'damper:={given["damper"]} is for policy {POLICY_OF_DAMPER}; instead received {policy}: '
                f'add policy:={POLICY_OF_DAMPER}'
            )
    if given['record'] != 'true':
        nodes = tuple(node for node in nodes if node is not RECORDER)
    nodes = of_mounts(nodes, mounts)
    return LaunchOrder(
        nodes,
        GraphSettings(
            namespace,
            domain,
            parameters={node.full_name: settings[node.full_name] for node in nodes},
            grouping=Grouping.COMPOSED if given['composed'] == 'true' else Grouping.APART,
            restart_limit=_number('restarts', given['restarts'], 1000),
            priority=_number('priority', given['priority'], HIGHEST),
            log_level=given['log_level'],
            log_to_screen=True,
        ),
    )


def _mount_names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(',')] if text else []
    if len(set(names)) < len(names) or not all(re.fullmatch('[a-z][a-z0-9_]*', name) for name in names):
        raise SettingError(f'mounts:={text} must name each mount once, in small letters, as in left,right')
    return names


def _known_parameters(nodes: Sequence[GraphNode]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: default}} of all that a parameter file can set."""
    known, driver = defaults_of_nodes([node.name for node in nodes]), DriverParameters()
    known[RECORDER.name] |= {'uri': '', 'mounts': '', 'topics': ['displacement']}
    if SIM in nodes:
        known[SIM.name] |= {'interface': '', 'channel': driver.channel, 'port': driver.port}
    return {node: {**values, 'use_sim_time': False} for node, values in known.items()}


def _of_arguments(graph: str, given: Mapping[str, str], known: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of a node's `known` parameters that arguments set, as texts and lists of texts."""
    values: dict[str, Any] = {}
    for argument in arguments_of(graph):
        text = given[argument.name]
        for name in (argument.sets or argument.name).split():
            if text and name in known:
                listed = isinstance(known[name], tuple)
                values[name] = [part.strip() for part in text.split(',')] if listed else text
    return values


def _separate_buses(mounts: Sequence[str], settings: dict[str, dict[str, Any]]) -> None:
    """Name the bus of each mount to the simulator; refuse one bus for two mounts."""
    buses: dict[Any, str] = {}
    for mount in mounts:
        driver = settings[name_in(mount, DRIVER.name)]
        if SIM.name in settings:
            settings[SIM.name][f'mount_{mount}.port'] = driver['port']
        # One of UDP multicast has a port of its own.
        bus = driver.get('interface', 'udp_multicast'), driver.get('channel')
        other = buses.setdefault((*bus, bus[0] == 'udp_multicast' and driver['port']), mount)
        if other != mount:
            raise SettingError(
                f'the mounts {other} and {mount} have one CAN bus, {driver.get("channel", driver["port"])}: '
                'give each its own as channel of its mount_driver in the config file, as two_mounts.yaml does'
            )


def _number(name: str, text: str, highest: int) -> int:
    """Return the whole number in the text of an argument."""
    if not text.isdecimal() or int(text) > highest:
        raise SettingError(f'{name}:={text} must be a number within 0 .. {highest}')
    return int(text)
