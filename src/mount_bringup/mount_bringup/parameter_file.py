"""Parameter files of ROS 2, checked before a node starts: ROS itself ignores an unknown name silently."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mount_bringup.settings import SettingError, general_name_of
from mount_models.plain_yaml import YamlError, yaml_in_file
from mount_models.quantity import check_name, nearest

_VALUES = 'ros__parameters'
_PARTS = {'**': '(/[^/]+)*', '*': '/[^/]+'}  # of a name: any number, one


def settings_of_file(
    file: Path, namespace: str, known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} that `file` gives the nodes in `namespace`, the later ones winning.

    `known` is {node: {parameter: default}}. Raises `SettingError` for a file that cannot be read or names
    none of these nodes, and `ParameterError` for a parameter that none of those named has.
    """
    try:
        content = yaml_in_file(file)
    except YamlError as error:
        raise SettingError(f'parameter file {file} {error}') from None
    return settings_in(content, str(file), namespace, known)


def settings_in(
    content: Any, file: str, namespace: str, known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return what `settings_of_file` does of the content of a file that refusals call `file`."""
    if not isinstance(content, Mapping):
        raise SettingError(f'parameter file {file} must name nodes with their {_VALUES}')
    settings: dict[str, dict[str, Any]] = {}
    for path, value in _leaves(content, ()):
        if _VALUES not in path:
            raise SettingError(f'{"/".join(["", *path])} must have {_VALUES}; instead received {value!r}')
        place = path.index(_VALUES)
        pattern, name = '/'.join(path[:place]).strip('/'), '.'.join(path[place + 1 :])
        nodes = [node for node in known if pattern.rpartition('/')[2] in (node, '*', '**')]
        if not nodes:
            raise SettingError(f'{file}: {pattern!r} is no node of the graph; {nearest(pattern, known)}')
        owners = [node for node in nodes if general_name_of(node, name) in known[node]]
        if not owners:
            names = {name for node in nodes for name in known[node]}
            check_name(f'{" or ".join(nodes)} ({file})', name, names)
        expression = ''.join(_PARTS.get(part, '/' + re.escape(part)) for part in pattern.split('/'))
        for node in owners:
            if re.fullmatch(expression, f'/{namespace.strip("/")}/{node}'.replace('//', '/')):
                settings.setdefault(node, {})[name] = value
    return settings


def _leaves(content: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the keys to each value; names may be nested as in namespaces."""
    if isinstance(content, Mapping):
        for key, inner in content.items():
            yield from _leaves(inner, (*path, str(key)))
    else:
        yield path, content
