"""The graph that the arguments of a launch file order; `ros2 launch` is not needed here."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mount_bringup.chosen import chosen_control, control_parameters
from mount_bringup.graph.domain import can_port, chosen_domain
from mount_bringup.graph.launch_arguments import POLICY_OF_DAMPER, VEHICLE_ARGUMENTS, LaunchArgument
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    VEHICLE,
    GraphNode,
    GraphSettings,
    Grouping,
    name_in,
    of_mounts,
)
from mount_bringup.parameter_file import settings_of_file
from mount_bringup.settings import (
    NODES,
    SettingError,
    check_sample_rate,
    checked_settings,
    defaults_of_nodes,
    settings_of_mount,
)
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import with_flattened
from mount_recorder.parameters import RecorderParameters
from mount_ros.nodes.real_time import HIGHEST
from mount_ros.topics import TOPICS

_CAN_OF_VEHICLE = {'interface': 'socketcan', 'channel': 'can0'}

Texts = Mapping[str, str]
"""{launch argument: text}."""
Settings = dict[str, dict[str, Any]]
"""{node: {parameter: value}}."""


class LaunchOrder(NamedTuple):
    """A graph as ordered by the arguments of a launch file; `duration` is in s, inf: until it is ended.

    In a replay `bag` is played to it, `rate` times as fast as it was recorded.
    """

    nodes: tuple[GraphNode, ...]
    settings: GraphSettings
    scenario: str
    duration: float = float('inf')
    bag: Path | None = None
    rate: float = 1.0


def vehicle_order(given: Texts) -> LaunchOrder:
    """Return the graph in the car; a `ValueError` says what cannot be."""
    order = launch_order(VEHICLE, VEHICLE_ARGUMENTS, given, 'car')
    duration = given['duration']
    return order._replace(duration=number_of('duration', duration, 1e9)) if duration else order


def launch_order(
    nodes: Sequence[GraphNode],
    arguments: Sequence[LaunchArgument],
    given: Texts,
    scenario: str,
    checked_mount: Callable[[Settings], Settings] = lambda settings: settings,
) -> LaunchOrder:
    """Return the graph of `nodes`; `checked_mount` checks and completes the settings of each mount."""
    records = is_recorded(given)
    mounts = _mount_names(given['mounts'])
    namespace, domain = given['namespace'].strip('/'), chosen_domain(None)
    known = known_parameters(nodes)
    settings: Settings = {}
    for node in of_mounts(nodes, mounts):
        space = name_in(namespace, node.mount)
        layers = of_file_and_arguments(arguments, given, known, space)
        settings[node.full_name] = {**_bus(node, can_port(domain, space), known), **layers.get(node.name, {})}
    if mounts:
        _tell_buses_apart(mounts, settings, given)
    settings = checked_settings(settings, known)
    for mount in mounts or ('',):
        own = checked_mount(settings_of_mount(settings, mount))
        settings[name_in(mount, CONTROL.name)] = own[CONTROL.name]
        check_damper(given['damper'], own)
        _check(own, known)
    chosen = of_mounts([node for node in nodes if records or node is not RECORDER], mounts)
    return LaunchOrder(
        nodes=chosen,
        settings=GraphSettings(
            namespace=namespace,
            domain=domain,
            parameters={node.full_name: settings[node.full_name] for node in chosen},
            grouping=Grouping.COMPOSED if given['composed'] == 'true' else Grouping.APART,
            restart_limit=number_of('restarts', given['restarts'], 1000, int),
            **process_settings(given),
        ),
        scenario=scenario,
    )


def process_settings(given: Texts) -> dict[str, Any]:
    """Return priority and log of the processes of a graph."""
    return {
        'priority': number_of('priority', given['priority'], HIGHEST, int),
        'log_level': given['log_level'],
        'log_to_screen': True,
    }


def is_recorded(given: Texts) -> bool:
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


def known_parameters(nodes: Sequence[GraphNode]) -> Settings:
    """Return {node: {parameter: default}} of all that a parameter file can set."""
    known, driver = defaults_of_nodes([node.name for node in nodes]), DriverParameters()
    bus = {'interface': 'udp_multicast', 'channel': driver.channel, 'port': driver.port}
    added = {SIM.name: bus, RECORDER.name: {'uri': '', 'mounts': '', 'topics': [t.name for t in TOPICS]}}
    return {name: values | added.get(name, {}) for name, values in known.items()}


def of_file_and_arguments(
    arguments: Sequence[LaunchArgument], given: Texts, known: Settings, space: str
) -> Settings:
    """Return the settings that the parameter file gives the nodes in `space`, and the arguments above it."""
    settings = settings_of_file(Path(given['config']), space, known) if given['config'] else {}
    for argument in arguments:
        text = given[argument.name]
        for target in argument.sets if text else ():
            node, _, name = target.partition('.')
            if node in known:
                value = _value(argument.name, text, known[node][name])
                settings.setdefault(node, {})[name] = value
    return settings


def check_damper(damper: str, settings: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise `SettingError` where the policy takes no damper."""
    policy = control_parameters(settings).policy
    if damper and policy != POLICY_OF_DAMPER:
        raise SettingError(
            f'damper:={damper} is for policy {POLICY_OF_DAMPER}; instead received {policy}: '
            f'add policy:={POLICY_OF_DAMPER}'
        )


def number_of(name: str, text: str, highest: float, kind: type = float) -> Any:
    """Return the number in the text of an argument, within 0 .. `highest`."""
    try:
        number = kind(text)
    except ValueError:
        number = -1
    if not 0 <= number <= highest:
        raise SettingError(f'{name}:={text} must be a number within 0 .. {highest:g}')
    return number


def _bus(node: GraphNode, port: int, known: Settings) -> dict[str, Any]:
    """Return the CAN bus of a node where neither file nor argument names one."""
    if node.is_a(DRIVER):
        return {'port': port} | ({} if SIM.name in known else _CAN_OF_VEHICLE)
    return {'port': port} if node.is_a(SIM) else {}


def _mount_names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(',')] if text else []
    if len(set(names)) < len(names) or not all(re.fullmatch('[a-z][a-z0-9_]*', name) for name in names):
        raise SettingError(f'mounts:={text} must name each mount once, in small letters, as in left,right')
    return names


def _tell_buses_apart(mounts: Sequence[str], settings: Settings, given: Texts) -> None:
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


def _value(name: str, text: str, default: Any) -> Any:
    if isinstance(default, str):
        return text
    if isinstance(default, tuple):
        return [part.strip() for part in text.split(',')]
    try:
        return plain_yaml(text)
    except YamlError as error:
        raise SettingError(f'{name}:={text} {error}') from None


def _check(settings: Settings, known: Settings) -> None:
    """Raise the `ValueError` of the first parameter of a mount outside its range, before a node has it."""
    sets = ((DRIVER, DriverParameters()), (RECORDER, RecorderParameters()), (INIT, InitParameters()))
    for node, defaults in sets:
        with_flattened(defaults, settings.get(node.name, {}))
    check_sample_rate(settings, [name for name in NODES if name in known])
    chosen_control(settings)
