"""Options `--set NODE.NAME=VALUE`, `--sample-rate` and sizes as settings of nodes; the mounts in them."""

import difflib
import re
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

from mount_bringup.settings import NODES, OF_EACH, Known, SettingError, defaults_of_nodes, settings_of_mount
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.automatic_marks import mark_kinds
from mount_recorder.parameters import RecorderParameters, check_split
from mount_sim.plant.mounts import mount_names

Settings = dict[str, dict[str, Any]]
_SIZES = {'B': 1, 'kB': 10**3, 'MB': 10**6, 'GB': 10**9, 'KiB': 1 << 10, 'MiB': 1 << 20, 'GiB': 1 << 30}
_DURATIONS = {'ms': 10**6, 's': 10**9, 'min': 60 * 10**9, 'h': 3600 * 10**9}
_AMOUNT = re.compile(r'\s*(\d+(?:\.\d+)?)\s*([A-Za-z]+)\s*')


def settings_of_options(options: Sequence[str], known: Known | None = None) -> Settings:
    """Return {node: {parameter: value}} of options [NODE.]NAME=VALUE.

    Raises `SettingError` for one that is not written like that.
    """
    parameters: Settings = {}
    for option in options:
        name, equals, text = option.partition('=')
        if not (equals and name):
            raise SettingError(f'--set {option}: write NAME=VALUE or NODE.NAME=VALUE, as in mount_sim.seed=2')
        node, parameter = owned(name, known)
        try:
            parameters.setdefault(node, {})[parameter] = plain_yaml(text)
        except YamlError as error:
            reason = str(error).removesuffix('; put it in quotes')
            raise SettingError(
                f'--set {option}: the value {text!r:.60} {reason}; put it in quotes of its own, as in '
                f'\'{option.removesuffix(text)}"{text}"\''
            ) from None
    return parameters


def owned(name: str, known: Known | None = None) -> tuple[str, str]:
    """Return node and parameter that `name` means, with its node before it or without.

    Without, it is a parameter of mount_control where that has it, else of the only node that does. Raises
    `ParameterError` with the nearest names if there is none, or with the nodes if there are several. `known`
    is {node: {parameter: default}} where others than nodes of the graph have parameters.
    """
    known = defaults_of_nodes() if known is None else known
    node, _, parameter = name.partition('.')
    if parameter and (node.rpartition('/')[2] in {*known, *NODES} or '/' in node):
        return node, parameter
    owners = [node for node, names in known.items() if name in names]
    if 'mount_control' in owners:
        return 'mount_control', name
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


def with_sample_rate(settings: Known, sample_rate: float | None) -> Settings:
    """Return the settings with `sample_rate` (Hz) for every node; None changes nothing."""
    completed = {node: dict(values) for node, values in settings.items()}
    for node in NODES if sample_rate is not None else ():
        completed.setdefault(node, {})['sample_rate'] = sample_rate
    return completed


def mounts_of(settings: Known) -> tuple[str, ...]:
    """Return the names of the mounts, none where there is one mount alone; raises `ParameterError`."""
    names = mount_names(str(settings.get('mount_sim', {}).get('mounts', '')))
    for node in settings:
        mount, slash, name = node.rpartition('/')
        if slash and (mount not in names or name not in OF_EACH):
            raise ParameterError(
                f'{node!r} is no node of this graph: its mounts are {", ".join(names) or "one alone"}, each '
                f'with {", ".join(OF_EACH)}'
            )
    return names


def settings_of_mounts(settings: Known) -> dict[str, dict[str, dict[str, Any]]]:
    """Return {mount: settings}; a mount alone has the name ''."""
    return {name: settings_of_mount(settings, name) for name in mounts_of(settings) or ('',)}


def recorder_options(split: str) -> dict[str, Any]:
    """Return {parameter: value} of the recorder of a size such as `500MB`; raises `ParameterError`."""
    return {'split_size': size_in_bytes(split)} if split else {}


def checked_recorder(options: Mapping[str, Any]) -> RecorderParameters:
    """Return the recorder's parameters, or raise the `ValueError` with which it would refuse them."""
    parameters = with_flattened(RecorderParameters(), options)
    check_split(parameters.split_size)
    mark_kinds(parameters.automatic_marks)
    if parameters.on_full not in ('stop', 'continue'):
        raise ParameterError(f'on_full must be stop or continue; instead received {parameters.on_full!r}')
    return parameters


def size_in_bytes(text: str) -> int:
    """Return the bytes of a text such as `500MB` or `2GiB`; raises `ParameterError`."""
    return _amount(text, _SIZES, 'size such as 500MB')


def duration_in_nanoseconds(text: str) -> int:
    """Return the ns of a text such as `30s` or `1.5min`; raises `ParameterError`."""
    return _amount(text, _DURATIONS, 'duration such as 30s')


def _amount(text: str, units: dict[str, int], wanted: str) -> int:
    match = _AMOUNT.fullmatch(text)
    if match is None or match[2] not in units:
        raise ParameterError(f'{text!r} is no {wanted}; units: {", ".join(units)}')
    return round(float(match[1]) * units[match[2]])
