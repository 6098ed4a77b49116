"""Message definitions and type hashes as rosbag2 puts them into a bag, from the installed packages.

The texts that rosbags makes of the same types lack their comments: other bytes than rosbag2 writes.
"""

import importlib.util
import json
import re
from functools import cache
from pathlib import Path

_DELIMITER = '=' * 80
_TYPE_NAME = re.compile(r'([A-Za-z][A-Za-z0-9_]*)/(?:msg/)?([A-Za-z][A-Za-z0-9_]*)')
_FIELD_TYPE = re.compile(r'^\s*([A-Za-z][A-Za-z0-9_/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\S', re.MULTILINE)
_PRIMITIVES = frozenset(('bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring')) | {
    f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)
}


class SchemaError(ValueError):
    """The definition of a message type is not to be found; the text names the type and the place."""


def schema_text(type_name: str) -> str:
    """Return the `ros2msg` text of `type_name`: its definition, then that of each dependency once.

    The order is that of rosbag2: depth first, the dependencies of one message in alphabetical order.
    `type_name` is such as `sensor_msgs/msg/JointState`; raises `SchemaError`.
    """
    return _definition_with_dependencies(type_name, seen=set())


def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of `type_name` from its installed type description; raises `SchemaError`."""
    package, kind = _split(type_name)
    path = package_share(package) / 'msg' / f'{kind}.json'
    full_name = f'{package}/msg/{kind}'
    try:
        description = json.loads(path.read_text(encoding='utf-8'))
        hashes = {entry['type_name']: entry['hash_string'] for entry in description['type_hashes']}
        return hashes[full_name]
    except (OSError, ValueError, KeyError, TypeError):
        raise SchemaError(f'no type hash of {full_name}: {path} is missing or not readable') from None


@cache
def package_share(package: str) -> Path:
    """Return the folder `share/<package>` of a ROS installation or of a wheel; raises `SchemaError`."""
    indexed = _share_by_index(package)
    if indexed is not None:
        return indexed
    spec = importlib.util.find_spec(package)
    if spec is not None and spec.origin:
        # A wheel puts share/ beside the lib/ that holds its Python package.
        for folder in Path(spec.origin).parents:
            share = folder / 'share' / package
            if (share / 'msg').is_dir():
                return share
    raise SchemaError(f'package {package!r} with its message definitions is not installed')


def _share_by_index(package: str) -> Path | None:
    try:
        from ament_index_python.packages import get_package_share_directory
    except ImportError:
        return None
    try:
        share = Path(get_package_share_directory(package))
    except (LookupError, ValueError, OSError):
        return None  # OSError: the wheels do not set the search path of the index
    return share if share.is_dir() else None


def _split(type_name: str) -> tuple[str, str]:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise SchemaError(f'{type_name!r} is no message type; expected the form package/msg/Name')
    return match[1], match[2]


def _definition_with_dependencies(type_name: str, seen: set[str]) -> str:
    package, kind = _split(type_name)
    path = package_share(package) / 'msg' / f'{kind}.msg'
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError):
        raise SchemaError(f'no definition of {type_name}: {path} is missing or not readable') from None
    result = text
    for dependency in _dependencies(text, package):
        if dependency not in seen:
            seen.add(dependency)
            nested = _definition_with_dependencies(dependency, seen)
            result += f'\n{_DELIMITER}\nMSG: {dependency}\n{nested}'
    return result


def _dependencies(text: str, package: str) -> list[str]:
    kinds = set(_FIELD_TYPE.findall(text)) - _PRIMITIVES
    return sorted(kind if '/' in kind else f'{package}/{kind}' for kind in kinds)
