"""The graph that the arguments of a launch file order; `ros2 launch` is not needed here."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mount_bringup.chosen import chosen_control, control_parameters
from mount_bringup.graph.domain import can_port, chosen_domain
from mount_bringup.graph.launch_arguments import POLICY_OF_DAMPER, LaunchArgument
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    GraphNode,
    GraphSettings,
    Grouping,
    of_mounts,
)
from mount_bringup.mount_choice import check_control_of_mount, with_control_of_mount
from mount_bringup.mounts import settings_of_mount
from mount_bringup.parameter_file import settings_of_file
from mount_bringup.sample_rate import NODES, check_sample_rate
from mount_bringup.settings import OF_EACH, SettingError, checked_settings, defaults_of_nodes
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import with_flattened
from mount_recorder.parameters import RecorderParameters
from mount_ros.nodes.real_time import HIGHEST
from mount_ros.topics import TOPICS
from mount_sim.electronics.faults.schedule import told_faults
from mount_sim.excitation.scenario import build_excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seated_mount
from mount_sim.plant.places import mount_names
from mount_sim.plant.simulated_car import SimulatedCar, mount_parameters

_CAN_OF_VEHICLE = {'interface': 'socketcan', 'channel': 'can0'}


class LaunchOrder(NamedTuple):
    """A graph as ordered by the arguments of a launch file; `duration` is in s, inf: until it is ended.

    In a replay `bag` is played to it, `rate` times as fast as it was recorded.
    """

    nodes: tuple[GraphNode, ...]
    settings: GraphSettings
    scenario: str
    duration: float
    log_level: str
    bag: Path | None = None
    rate: float = 1.0


def launch_order(
    nodes: Sequence[GraphNode], arguments: Sequence[LaunchArgument], given: Mapping[str, str]
) -> LaunchOrder:
    """Return the graph for the texts `given`, {argument: text}; a `ValueError` says what cannot be."""
    records = given['record'] == 'true'
    if records and not given['recording']:
        raise SettingError('a recording needs a folder: recording:=bags/first; or record:=false')
    mounts = mount_names(given['mounts'])
    chosen = of_mounts([node for node in nodes if records or node is not RECORDER], mounts)
    namespace, domain = given['namespace'].strip('/'), chosen_domain(None)
    known = {
        name: values for name, values in known_parameters().items() if name in {node.name for node in nodes}
    }
    given_to = partial(_given_to, arguments, given, known, domain)
    if mounts:
        settings = _of_mounts(mounts, given, partial(given_to, namespace))
    else:
        settings = with_control_of_mount(checked_settings(given_to(namespace, ''), known))
        check_damper(given['damper'], settings)
        _check(settings)
    sim = settings.get(SIM.name, {}) if SIM in nodes else {'scenario': 'car'}
    return LaunchOrder(
        nodes=chosen,
        settings=GraphSettings(
            namespace=namespace,
            domain=domain,
            parameters={node.full_name: settings.get(node.full_name, {}) for node in chosen},
            grouping=Grouping.COMPOSED if given['composed'] == 'true' else Grouping.APART,
            priority=number_of('priority', given['priority'], HIGHEST, int),
            restart_limit=number_of('restarts', given['restarts'], 1000, int),
        ),
        scenario=sim.get('scenario', SimParameters().scenario),
        duration=_duration(nodes, given),
        log_level=given['log_level'],
    )


def check_folder(order: LaunchOrder) -> None:
    """Raise `SettingError` if the folder of the recording exists, before anything is started for it."""
    uri = order.settings.parameters.get(RECORDER.name, {}).get('uri')
    if uri and Path(str(uri)).expanduser().exists():
        raise SettingError(
            f'recording:={uri} exists already; a recording is never written over: name another folder or '
            'remove it'
        )


def _given_to(
    arguments: Sequence[LaunchArgument],
    given: Mapping[str, str],
    known: Mapping[str, Mapping[str, Any]],
    domain: int,
    namespace: str,
    mount: str,
) -> dict[str, dict[str, Any]]:
    """Return what file and arguments give the nodes of a mount, or of the graph."""
    space = f'{namespace}/{mount}'.strip('/')
    port = {'port': can_port(domain, space)}
    settings: dict[str, dict[str, Any]] = {DRIVER.name: port | ({} if SIM.name in known else _CAN_OF_VEHICLE)}
    if SIM.name in known:
        settings[SIM.name] = dict(port)
    for layer in (settings_of_file(Path(given['config']), space, known), of_arguments(arguments, given)):
        for name, values in layer.items():
            settings.setdefault(name, {}).update(values)
    return settings


def _of_mounts(
    mounts: Sequence[str], given: Mapping[str, str], given_to: Callable[[str], dict[str, dict[str, Any]]]
) -> dict[str, dict[str, Any]]:
    """Return the checked settings of a graph of several mounts."""
    if given['port']:
        raise SettingError(f'port:={given["port"]} is for one mount; each of several has a port of its own')
    shared = given_to('')
    channels = _channels(mounts, given)
    shared.setdefault(RECORDER.name, {})['mounts'] = ','.join(mounts)
    settings = {name: values for name, values in shared.items() if name in (RECORDER.name, SIM.name)}
    if SIM.name in settings:
        settings[SIM.name]['mounts'] = ','.join(mounts)
    for mount in mounts:
        own = given_to(mount)
        own[DRIVER.name] |= channels.get(mount, {})
        if SIM.name in settings:
            settings[SIM.name][f'mount_{mount}.port'] = own[DRIVER.name]['port']
        settings |= {f'{mount}/{name}': own.get(name, {}) for name in OF_EACH}
    if SIM.name not in settings:
        _check_channels(mounts, settings)
    known = known_parameters()
    settings = checked_settings(settings, known)
    for mount in mounts:
        whole = with_control_of_mount(settings_of_mount(settings, mount))
        check_damper(given['damper'], whole)
        _check(whole)
        settings[f'{mount}/{CONTROL.name}'] = whole.get(CONTROL.name, {})
    if SIM.name in settings:
        values = settings[SIM.name]
        SimulatedCar(values, build_excitation(mount_parameters(values)))
    return settings


def _channels(mounts: Sequence[str], given: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """Return the channel that the arguments give each mount in the car."""
    if not given.get('channels'):
        return {}
    names = [name.strip() for name in given['channels'].split(',') if name.strip()]
    if len(names) != len(mounts) or len(set(names)) < len(names):
        raise SettingError(
            f'channels:={given["channels"]} must name a channel for each of the mounts {", ".join(mounts)}, '
            'as in channels:=can0,can1'
        )
    return {mount: {'channel': name} for mount, name in zip(mounts, names, strict=True)}


def _check_channels(mounts: Sequence[str], settings: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise `SettingError` where two mounts have one CAN bus."""
    buses: dict[Any, str] = {}
    for mount in mounts:
        driver = settings[f'{mount}/{DRIVER.name}']
        multicast = driver['interface'] == 'udp_multicast'  # there a port of its own tells a bus from another
        other = buses.setdefault((driver['channel'], driver['port'] if multicast else 0), mount)
        if other != mount:
            raise SettingError(
                f'the mounts {other} and {mount} have one CAN bus, {driver["channel"]}: give each its own, '
                'as in channels:=can0,can1, or as channel of its mount_driver in the config file'
            )


def known_parameters() -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: default}} of all that a parameter file can set."""
    known, driver = defaults_of_nodes(), DriverParameters()
    known[SIM.name] |= {'interface': 'udp_multicast', 'channel': driver.channel, 'port': driver.port}
    known[RECORDER.name] |= {'uri': '', 'mounts': '', 'topics': [topic.name for topic in TOPICS]}
    return known


def of_arguments(arguments: Sequence[LaunchArgument], given: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    settings: dict[str, dict[str, Any]] = {}
    for argument in arguments:
        text = given[argument.name]
        for target in argument.sets if text else ():
            node, _, name = target.partition('.')
            value = _value(argument.name, text, known_parameters()[node][name])
            settings.setdefault(node, {})[name] = value
    return settings


def _value(name: str, text: str, default: Any) -> Any:
    if isinstance(default, str):
        return text
    if isinstance(default, tuple):
        return [part.strip() for part in text.split(',')]
    try:
        return plain_yaml(text)
    except YamlError as error:
        raise SettingError(f'{name}:={text} {error}') from None


def check_damper(damper: str, settings: Mapping[str, Mapping[str, Any]]) -> None:
    policy = control_parameters(settings).policy
    if damper and policy != POLICY_OF_DAMPER:
        raise SettingError(
            f'damper:={damper} is for policy {POLICY_OF_DAMPER}; instead received {policy}: '
            f'add policy:={POLICY_OF_DAMPER}'
        )


def _check(settings: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise the `ValueError` of the first parameter outside its range, before a node has it."""
    sets = ((DRIVER, DriverParameters()), (RECORDER, RecorderParameters()), (INIT, InitParameters()))
    for node, defaults in sets:
        with_flattened(defaults, settings.get(node.name, {}))
    sim = with_flattened(SimParameters(), settings.get(SIM.name, {}))
    seated_mount(sim.mount)
    told_faults(sim.faults)
    build_excitation(sim)
    check_sample_rate(settings, [name for name in NODES if name != SIM.name or name in settings])
    check_control_of_mount(settings)
    chosen_control(settings)


def _duration(nodes: Sequence[GraphNode], given: Mapping[str, str]) -> float:
    if SIM in nodes or not given['duration']:
        return float('inf')  # the simulator tells its end
    return number_of('duration', given['duration'], 1e9, float)


def number_of(name: str, text: str, highest: float, kind: type) -> Any:
    try:
        number = kind(text)
    except ValueError:
        number = -1
    if not 0 <= number <= highest:
        raise SettingError(f'{name}:={text} must be a number within 0 .. {highest:g}')
    return number
