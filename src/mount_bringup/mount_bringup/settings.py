"""Parameters of the nodes as given by the user: names known, types as declared, before a node starts."""

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

from mount_bags.recorder.parameters import RecorderParameters
from mount_control import settings as control
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.damper import damper_text
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError, check_name, flattened
from mount_models.specimen_choice import SpecimenChoice
from mount_sim.parameters import NodeParameters, SimParameters
from mount_sim.plant.places import general_name

OF_EACH = ('mount_driver', 'mount_init', 'mount_control')
"""Nodes that each mount of a car has."""


class SettingError(ParameterError):
    """An option `--set` is not written as it must be; the text says how."""


def defaults_of_nodes() -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: default}} of all that can be set from outside."""
    return {
        'mount_driver': {**flattened(DriverParameters()), **flattened(SpecimenChoice())},
        'mount_sim': {**flattened(SimParameters()), **flattened(NodeParameters())},
        'mount_init': {**flattened(InitParameters()), **flattened(SpecimenChoice())},
        'mount_control': control.defaults(),
        'mount_recorder': flattened(RecorderParameters()),
    }


def settings_of_options(options: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of options NODE.NAME=VALUE; raises `SettingError`."""
    parameters: dict[str, dict[str, Any]] = {}
    for option in options:
        name, equals, text = option.partition('=')
        node, dot, parameter = name.partition('.')
        if not (equals and dot and parameter):
            raise SettingError(f'--set {option}: write NODE.NAME=VALUE, as in mount_sim.seed=2')
        parameters.setdefault(node, {})[parameter] = setting_value(option, text)
    return parameters


def setting_value(option: str, text: str) -> Any:
    """Return the value that `text` (YAML) in `--set option` gives; raises `SettingError`."""
    try:
        return plain_yaml(text)
    except YamlError as error:
        reason = str(error).removesuffix('; put it in quotes')
        raise SettingError(
            f'--set {option}: the value {text!r:.60} {reason}; put it in quotes of its own, as in '
            f'\'{option.removesuffix(text)}"{text}"\''
        ) from None


def checked_settings(
    settings: Mapping[str, Mapping[str, Any]],
    known: Mapping[str, Mapping[str, Any]] | None = None,
    owner: str = 'node of the graph',
) -> dict[str, dict[str, Any]]:
    """Return the settings in the types that the nodes declare; unknown names raise `ParameterError`.

    ROS itself takes an unknown parameter silently. `known` is {node: {parameter: default}} where others
    than nodes of the graph have parameters; `owner` is what those are called in the refusal.
    """
    if known is None:
        known = defaults_of_nodes()
    checked: dict[str, dict[str, Any]] = {}
    for node, values in settings.items():
        kind = node.rpartition('/')[2]  # of a node of one mount, as in left/mount_control
        if kind not in known or (kind != node and kind not in OF_EACH):
            raise ParameterError(f'{node!r} is no {owner}; known are {", ".join(known)}')
        for name in values:
            check_name(node, _general(kind, name), known[kind])
        checked[node] = {
            name: _typed(f'{node}.{name}', value, known[kind][_general(kind, name)])
            for name, value in _with_damper_text(kind, values).items()
        }
    return checked


def _general(node: str, name: str) -> str:
    """Return the parameter behind that of one mount, as in mount_sim.mount_left.friction.scale."""
    return general_name(name) if node == 'mount_sim' else name


def _with_damper_text(node: str, values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return `values` with the damper as one text that needs no file, as a session can keep it."""
    damper = values.get('damper')
    if node != 'mount_control' or not isinstance(damper, (str, Mapping)):
        return values
    return {**values, 'damper': damper_text(damper)}


def _texts(name: str, value: Any) -> list[str]:
    if isinstance(value, (list, tuple)) and value and all(isinstance(text, str) for text in value):
        return list(value)
    raise ParameterError(
        f'{name} must be a list of at least one text, or be left out; instead received {value!r}'
    )


def _typed(name: str, value: Any, default: Any) -> Any:
    if isinstance(default, float) and not isinstance(value, bool):
        with contextlib.suppress(TypeError, ValueError):
            return float(value)  # of 3e-5 too, which is text in YAML
    if isinstance(default, tuple):
        return _texts(name, value)
    if not isinstance(value, type(default)):
        raise ParameterError(
            f'{name} must be a {type(default).__name__} such as {default!r}; instead received {value!r}'
        )
    return value
