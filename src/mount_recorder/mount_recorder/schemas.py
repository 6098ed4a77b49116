"""Message definitions and type hashes as rosbag2 puts them into a bag, from the installed packages.

The texts that rosbags makes of the same types lack their comments: other bytes than rosbag2 writes.
"""

import importlib.util
import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

_FIELD_TYPE = re.compile(r'^\s*([A-Za-z][A-Za-z0-9_/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\S', re.MULTILINE)
_PRIMITIVE = re.compile(r'bool|byte|char|float(32|64)|w?string|u?int(8|16|32|64)')


class SchemaError(ValueError):
    """The definition of a message type is not to be found; the text names the type and the place."""


other_definitions: Callable[[str], tuple[str, str] | None] | None = None
"""Returns text and hash of a type that is not installed; the desk sets it, for a desk works without ROS."""


def schema_text(type_name: str) -> str:
    """Return the `ros2msg` text of `type_name`: its definition, then that of each dependency once.

    The order is that of rosbag2: depth first, the dependencies of one message in alphabetical order.
    `type_name` is such as `sensor_msgs/msg/JointState`; raises `SchemaError`.
    """
    return _definition(type_name)[0]


def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of `type_name` from its installed type description; raises `SchemaError`."""
    return _definition(type_name)[1]


@cache
def _definition(type_name: str) -> tuple[str, str]:
    try:
        text = _text_with_dependencies(type_name, set())
        hashes = json.loads(_installed(type_name, 'json'))['type_hashes']
        return text, next(entry['hash_string'] for entry in hashes if entry['type_name'] == type_name)
    except SchemaError:
        found = other_definitions(type_name) if other_definitions else None
        if found is None:
            raise
        return found


def _text_with_dependencies(type_name: str, seen: set[str]) -> str:
    text = _installed(type_name, 'msg')
    package = type_name.partition('/')[0]
    kinds = {kind for kind in _FIELD_TYPE.findall(text) if not _PRIMITIVE.fullmatch(kind)}
    for dependency in sorted(kind if '/' in kind else f'{package}/{kind}' for kind in kinds):
        if dependency not in seen:
            seen.add(dependency)
            nested = _text_with_dependencies(dependency, seen)
            text += f'\n{"=" * 80}\nMSG: {dependency}\n{nested}'
    return text


@cache
def _installed(type_name: str, suffix: str) -> str:
    """Return the text of a file `share/<package>/msg/<Name>.<suffix>`, of a ROS installation or a wheel."""
    package, name = type_name.split('/')[0], type_name.split('/')[-1]
    if package == name:
        raise SchemaError(f'{type_name!r} is no message type; expected the form package/msg/Name')
    spec = importlib.util.find_spec(package)
    # Both have share/ beside the lib/ that holds the Python package.
    for folder in Path(spec.origin).parents if spec is not None and spec.origin else ():
        path = folder / 'share' / package / 'msg' / f'{name}.{suffix}'
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise SchemaError(
        f'no definition of {type_name}: {name}.{suffix} of package {package!r} is not installed'
    )
