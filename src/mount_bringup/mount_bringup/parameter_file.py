"""Parameter files of ROS 2, checked before a node starts: ROS itself ignores an unknown name silently."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mount_bringup.settings import SettingError, general_name_of
from mount_models.plain_yaml import YamlError, yaml_in_file
from mount_models.quantity import check_name

_VALUES = 'ros__parameters'


def settings_of_file(
    file: Path, namespace: str, known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} that `file` gives the nodes in `namespace`, the later ones winning.

    `known` is {node: {parameter: default}}. Raises `SettingError` for a file that cannot be read or names
    none of these nodes, and `ParameterError` for a parameter that none of those named has.
    """
    return settings_in(_content(file), str(file), namespace, known)


def settings_in(
    content: Any, file: str, namespace: str, known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return what `settings_of_file` does of the content of a file that refusals call `file`."""
    if not isinstance(content, Mapping):
        raise SettingError(f'parameter file {file} must name nodes with their {_VALUES}')
    settings: dict[str, dict[str, Any]] = {}
    for pattern, values in _entries(content):
        nodes = [node for node in known if _named(pattern, node)]
        if not nodes:
            raise SettingError(f'{file}: {pattern!r} is no node of the graph; known are {", ".join(known)}')
        for name, value in _flat(values):
            owners = [node for node in nodes if general_name_of(node, name) in known[node]]
            if not owners:
                names = {name for node in nodes for name in known[node]}
                check_name(f'{" or ".join(nodes)} ({file})', name, names)
            for node in owners:
                if _matches(pattern, f'{namespace.strip("/")}/{node}'):
                    settings.setdefault(node, {})[name] = value
    return settings


def _content(file: Path) -> Any:
    try:
        return yaml_in_file(file)
    except YamlError as error:
        raise SettingError(f'parameter file {file} {error}') from None


def _entries(content: Mapping[str, Any], path: str = '') -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the pattern of node names and the values of each entry; names may be nested as in namespaces."""
    for key, inner in content.items():
        if not isinstance(inner, Mapping):
            raise SettingError(f'{path}/{key} must have {_VALUES}; instead received {inner!r}')
        if key == _VALUES:
            yield path, inner
        else:
            yield from _entries(inner, f'{path}/{str(key).strip("/")}')


def _flat(values: Mapping[str, Any], prefix: str = '') -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}', value


def _named(pattern: str, node: str) -> bool:
    """Whether a pattern can mean `node` in some namespace."""
    return pattern.rpartition('/')[2] in (node, '*', '**')


def _matches(pattern: str, name: str) -> bool:
    """Whether a full name matches, `*` standing for one part of it and `**` for any number of them."""
    parts = {'**': '(/[^/]+)*', '*': '/[^/]+'}
    expression = ''.join(parts.get(part, '/' + re.escape(part)) for part in pattern.strip('/').split('/'))
    return re.fullmatch(expression, f'/{name.strip("/")}') is not None
