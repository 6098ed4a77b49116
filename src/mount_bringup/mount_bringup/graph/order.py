"""The graph that the arguments of a launch file order; `ros2 launch` is not needed here."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mount_bringup.graph.domain import can_port, chosen_domain
from mount_bringup.graph.launch_arguments import POLICY_OF_DAMPER, arguments_of
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    RECORDER,
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
from mount_control.policy.registry import DEFAULT
from mount_driver.parameters import DriverParameters
from mount_ros.nodes.real_time import HIGHEST
from mount_ros.topics import TOPICS

_CAN_OF_VEHICLE = {'interface': 'socketcan', 'channel': 'can0'}

Texts = Mapping[str, str]
"""{launch argument: text}."""
Settings = dict[str, dict[str, Any]]
"""{node: {parameter: value}}."""


class LaunchOrder(NamedTuple):
    """A graph as ordered by the arguments of a launch file; `duration` is in s, inf: until it is ended."""

    nodes: tuple[GraphNode, ...]
    settings: GraphSettings
    duration: float = float('inf')


def launch_order(graph: str, given: Texts) -> LaunchOrder:
    """Return the graph of a launch file; a `ValueError` says what cannot be.

    Names, types and what must fit together are checked here; the range of a value is checked by its node.
    """
    nodes, records = SIMULATED if graph == 'sim' else VEHICLE, _is_recorded(given)
    namespace, domain = given['namespace'].strip('/'), chosen_domain(None)
    mounts, known = _mount_names(given['mounts']), _known_parameters(nodes)
    if SIM in nodes:  # not in the car
        from mount_sim.plant.mounts import check_control_of_mount, mount_names, with_control_of_mount

        mount_names(given['mounts'])
    settings: Settings = {}
    for node in of_mounts(nodes, mounts):
        space = name_in(namespace, node.mount)
        own = settings_of_file(Path(given['config']), space, known) if given['config'] else {}
        bus: dict[str, Any] = {'port': can_port(domain, space)} if node.is_a(DRIVER, SIM) else {}
        if node.is_a(DRIVER) and SIM not in nodes:
            bus |= _CAN_OF_VEHICLE
        settings[node.full_name] = bus | own.get(node.name, {}) | _of_arguments(graph, given, node, known)
    if mounts:
        _separate_buses(mounts, settings, given)
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
    chosen = of_mounts([node for node in nodes if records or node is not RECORDER], mounts)
    duration = given['duration'] if SIM not in nodes else ''  # the simulator ends its drive itself
    return LaunchOrder(
        nodes=chosen,
        settings=GraphSettings(
            namespace=namespace,
            domain=domain,
            parameters={node.full_name: settings[node.full_name] for node in chosen},
            grouping=Grouping.COMPOSED if given['composed'] == 'true' else Grouping.APART,
            restart_limit=_number('restarts', given['restarts'], 1000, int),
            priority=_number('priority', given['priority'], HIGHEST, int),
            log_level=given['log_level'],
            log_to_screen=True,
        ),
        duration=_number('duration', duration, 1e9) if duration else float('inf'),
    )


def _is_recorded(given: Texts) -> bool:
    """Return whether the graph records; refuse a recording without a folder or into one that exists."""
    recording = given['recording']
    if given['record'] != 'true':
        return False
    if not recording:
        raise SettingError('a recording needs a folder: recording:=bags/first; or record:=false')
    if Path(recording).expanduser().exists():
        raise SettingError(
            f'recording:={recording} exists already; a recording is never written over: name another folder '
            'or remove it'
        )
    return True


def _mount_names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(',')] if text else []
    if len(set(names)) < len(names) or not all(re.fullmatch('[a-z][a-z0-9_]*', name) for name in names):
        raise SettingError(f'mounts:={text} must name each mount once, in small letters, as in left,right')
    return names


def _known_parameters(nodes: Sequence[GraphNode]) -> Settings:
    """Return {node: {parameter: default}} of all that a parameter file can set."""
    known, driver = defaults_of_nodes([node.name for node in nodes]), DriverParameters()
    known[RECORDER.name] |= {'uri': '', 'mounts': '', 'topics': [topic.name for topic in TOPICS]}
    if SIM in nodes:
        known[SIM.name] |= {'interface': '', 'channel': driver.channel, 'port': driver.port}
    return known


def _of_arguments(graph: str, given: Texts, node: GraphNode, known: Settings) -> dict[str, Any]:
    """Return the parameters of a node that arguments set."""
    values = {}
    for argument in arguments_of(graph):
        text = given[argument.name]
        for target in argument.sets.split() if text else ():
            owner, _, name = target.partition('.')
            if owner == node.name:
                values[name] = _value(text, known[owner][name])
    return values


def _value(text: str, default: Any) -> Any:
    """Return a text in the type of the default, or as it stands where it cannot be of that type."""
    if isinstance(default, tuple):
        return [part.strip() for part in text.split(',')]
    try:
        return type(default)(text)
    except ValueError:
        return text


def _separate_buses(mounts: Sequence[str], settings: Settings, given: Texts) -> None:
    """Give each mount its bus, and name the mounts to the nodes that all share."""
    if given['port']:
        raise SettingError(f'port:={given["port"]} is for one mount; each of several has a port of its own')
    for name in {RECORDER.name, SIM.name} & settings.keys():
        settings[name]['mounts'] = ','.join(mounts)
    drivers = {mount: settings[name_in(mount, DRIVER.name)] for mount in mounts}
    if SIM.name in settings:
        settings[SIM.name] |= {f'mount_{mount}.port': driver['port'] for mount, driver in drivers.items()}
        return
    channels = [name.strip() for name in given['channels'].split(',') if name.strip()]
    if channels and len(set(channels)) != len(mounts):
        raise SettingError(
            f'channels:={given["channels"]} must name a channel for each of the mounts {", ".join(mounts)}, '
            'as in channels:=can0,can1'
        )
    for driver, channel in zip(drivers.values(), channels, strict=False):
        driver['channel'] = channel
    buses: dict[Any, str] = {}
    for mount, driver in drivers.items():
        multicast = driver['interface'] == 'udp_multicast'  # there each bus has a port of its own
        other = buses.setdefault((driver['channel'], multicast and driver['port']), mount)
        if other != mount:
            raise SettingError(
                f'the mounts {other} and {mount} have one CAN bus, {driver["channel"]}: give each its own, '
                'as in channels:=can0,can1, or as channel of its mount_driver in the config file'
            )


def _number(name: str, text: str, highest: float, kind: type = float) -> Any:
    """Return the number in the text of an argument, within 0 .. `highest`."""
    try:
        number = kind(text)
    except ValueError:
        number = -1
    if not 0 <= number <= highest:
        raise SettingError(f'{name}:={text} must be a number within 0 .. {highest:g}')
    return number
