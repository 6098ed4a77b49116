"""The settings of a user for the nodes: names known, types as declared, before a node starts."""

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from mount_control import settings as control
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.damper import damper_text
from mount_models.quantity import ParameterError, check_name, flattened, nearest
from mount_models.sampling import SAMPLE_RATE, sample_time_ns
from mount_models.specimen_choice import SpecimenChoice
from mount_recorder.parameters import RecorderParameters

Known = Mapping[str, Mapping[str, Any]]
OF_EACH = ('mount_driver', 'mount_init', 'mount_control')
"""Nodes that each mount of a car has."""
NODES = ('mount_driver', 'mount_sim', 'mount_init', 'mount_control', 'mount_recorder')


class SettingError(ParameterError):
    """An option `--set` is not written as it must be; the text says how."""


def defaults_of_nodes(nodes: Sequence[str] = NODES) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: default}} of all that can be set from outside."""
    return {node: _defaults(node) for node in NODES if node in nodes}


def _defaults(node: str) -> dict[str, Any]:
    if node == 'mount_control':
        return control.defaults()
    declared: tuple[NamedTuple, ...] = (RecorderParameters(),)
    if node == 'mount_sim':
        from mount_sim.parameters import NodeParameters, SimParameters  # not in the car

        declared = SimParameters(), NodeParameters()
    elif node in OF_EACH:
        declared = DriverParameters() if node == 'mount_driver' else InitParameters(), SpecimenChoice()
    return {name: value for each in declared for name, value in flattened(each).items()}


def checked_settings(
    settings: Mapping[str, Mapping[str, Any]],
    known: Known | None = None,
    owner: str = 'node of the graph',
) -> dict[str, dict[str, Any]]:
    """Return the settings in the types that the nodes declare; unknown names raise `ParameterError`.

    ROS itself takes an unknown parameter silently. `known` is {node: {parameter: default}} where others
    than nodes of the graph have parameters; `owner` is what those are called in the refusal.
    """
    known = known or defaults_of_nodes()
    checked: dict[str, dict[str, Any]] = {}
    for node, values in settings.items():
        kind = node.rpartition('/')[2]  # of a node of one mount, as in left/mount_control
        if kind not in known or (kind != node and kind not in OF_EACH):
            raise ParameterError(f'{node!r} is no {owner}; {nearest(node, known)}')
        for name in values:
            check_name(node, general_name_of(kind, name), known[kind])
        checked[node] = {
            name: _typed(f'{node}.{name}', value, known[kind][general_name_of(kind, name)])
            for name, value in values.items()
        }
    return checked


def general_name_of(node: str, name: str) -> str:
    """Return the parameter behind that of one mount, as in mount_sim.mount_left.friction.scale."""
    if node != 'mount_sim' or not name.startswith('mount_'):
        return name
    from mount_sim.plant.mounts import general_name

    return general_name(name)


def _typed(name: str, value: Any, default: Any) -> Any:
    if name.endswith('mount_control.damper') and isinstance(value, (str, Mapping)):
        return damper_text(value)  # one text that needs no file, as a session can keep it
    if isinstance(default, float) and not isinstance(value, bool):
        with contextlib.suppress(TypeError, ValueError):
            return float(value)  # of 3e-5 too, which is text in YAML
    if isinstance(default, bool) and isinstance(value, str):  # of a launch argument
        value = {'true': True, 'false': False}.get(value.lower(), value)
    if isinstance(default, tuple):
        if isinstance(value, (list, tuple)) and value and all(isinstance(text, str) for text in value):
            return list(value)
        raise ParameterError(
            f'{name} must be a list of at least one text, or be left out; instead received {value!r}'
        )
    if not isinstance(value, type(default)):
        raise ParameterError(
            f'{name} must be a {type(default).__name__} such as {default!r}; instead received {value!r}'
        )
    return value


def check_sample_rate(
    settings: Known, nodes: Iterable[str] = (*OF_EACH, 'mount_sim', 'mount_recorder')
) -> float:
    """Return the rate (Hz) of the nodes of a graph; raises `ParameterError` unless they have the same."""
    rates = {node: settings.get(node, {}).get('sample_rate', SAMPLE_RATE) for node in nodes if node in NODES}
    (first, rate), *others = rates.items()
    for node, other in others:
        if other != rate:
            raise ParameterError(
                f'{node}.sample_rate ({other:g} Hz) must equal {first}.sample_rate ({rate:g} Hz); set one '
                'for the whole graph: --sample-rate of a drive, sample_rate:= of a launch file'
            )
    sample_time_ns(rate)
    return float(rate)


def settings_of_mount(settings: Known, mount: str) -> dict[str, dict[str, Any]]:
    """Return the settings as they hold for one mount, by the names that the nodes have where it is alone."""
    found = {node: dict(values) for node, values in settings.items() if '/' not in node}
    for node in OF_EACH:
        if own := settings.get(f'{mount}/{node}'):
            found[node] = {**found.get(node, {}), **own}
    if 'mount_sim' in found:
        from mount_sim.plant.mounts import values_of_mount

        found['mount_sim'] = values_of_mount(found['mount_sim'], mount)
    return found
