"""Parameters of the nodes as given by the user: names known, types as declared, before a node starts."""

import contextlib
import difflib
import functools
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any

from mount_control import settings as control
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.damper import damper_text
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError, check_name, flattened
from mount_models.specimen_choice import SpecimenChoice
from mount_recorder.parameters import RecorderParameters
from mount_sim.parameters import NodeParameters, SimParameters
from mount_sim.plant.places import general_name

Known = Mapping[str, Mapping[str, Any]]
_FIRST = 'mount_control'  # the node that is meant where none is named

OF_EACH = ('mount_driver', 'mount_init', 'mount_control')
"""Nodes that each mount of a car has."""
_NODES = (*OF_EACH, 'mount_sim', 'mount_recorder')


class SettingError(ParameterError):
    """An option `--set` is not written as it must be; the text says how."""


def defaults_of_nodes() -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: default}} of all that can be set from outside."""
    return {
        'mount_driver': {**_defaults(DriverParameters), **_defaults(SpecimenChoice)},
        'mount_sim': {**_defaults(SimParameters), **_defaults(NodeParameters)},
        'mount_init': {**_defaults(InitParameters), **_defaults(SpecimenChoice)},
        'mount_control': control.defaults(),  # not kept: a policy may be registered later
        'mount_recorder': {**_defaults(RecorderParameters)},
    }


@functools.cache
def _defaults(parameters: Callable[[], Any]) -> Mapping[str, Any]:
    return flattened(parameters())


def settings_of_options(options: Sequence[str], known: Known | None = None) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of options [NODE.]NAME=VALUE, which `owned` understands.

    Raises `SettingError` for one that is not written like that.
    """
    parameters: dict[str, dict[str, Any]] = {}
    for option in options:
        name, equals, text = option.partition('=')
        if not (equals and name):
            raise SettingError(f'--set {option}: write NAME=VALUE or NODE.NAME=VALUE, as in mount_sim.seed=2')
        node, parameter = owned(name, known)
        parameters.setdefault(node, {})[parameter] = setting_value(option, text)
    return parameters


def owned(name: str, known: Known | None = None) -> tuple[str, str]:
    """Return node and parameter that `name` means, with its node before it or without.

    Without, it is a parameter of mount_control where that has it, else of the only node that does. Raises
    `ParameterError` with the nearest names if there is none, or with the nodes if there are several. `known`
    is {node: {parameter: default}} where others than nodes of the graph have parameters.
    """
    known = defaults_of_nodes() if known is None else known
    node, _, parameter = name.partition('.')
    if parameter and (node.rpartition('/')[2] in {*known, *_NODES} or '/' in node):
        return node, parameter
    owners = [node for node, names in known.items() if name in names]
    if _FIRST in owners:
        return _FIRST, name
    if len(owners) > 1:
        raise ParameterError(
            f'{name!r} is a parameter of {", ".join(owners)}: write which, as in {owners[0]}.{name}'
        )
    if owners:
        return owners[0], name
    names = [*(f'{node}.{each}' for node, names in known.items() for each in names), *chain(*known.values())]
    near = difflib.get_close_matches(name, names, n=3)
    hint = f'did you mean {" or ".join(near)}?' if near else f'write NODE.NAME, of {", ".join(known)}'
    raise ParameterError(f'{name!r} is no parameter of any node; {hint}')


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
    known: Known | None = None,
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
            near = difflib.get_close_matches(kind, known, n=1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise ParameterError(f'{node!r} is no {owner}{hint or "; known are " + ", ".join(known)}')
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
