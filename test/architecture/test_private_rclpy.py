"""Names of rclpy that are not public stand in one file; a new rclpy may change them without a word."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import rclpy
from sources import REPOSITORY, SOURCES, modules_of

HOME = SOURCES / 'mount_ros' / 'mount_ros' / 'private_rclpy.py'
ITS_TEST = SOURCES / 'mount_ros' / 'test' / 'test_private_rclpy.py'
FILES = sorted({*SOURCES.rglob('*.py'), *(REPOSITORY / 'test').rglob('*.py')} - {HOME, ITS_TEST})
NODES = {'Node', 'LifecycleNode', 'OpenLifecycleNode', 'SafeLifecycleNode'}
"""Classes of which a derived one must not use, nor define by chance, a private name of rclpy's."""
WHERE = ('node.py', 'lifecycle/*.py', 'publisher.py', 'subscription.py', 'executors.py', 'context.py')
"""Files of rclpy whose private names are looked for."""


def test_private_names_of_rclpy_stand_in_one_file():
    assert set(private_uses(HOME.read_text())) >= {'handle', '_state_machine'}
    found = {(str(file.relative_to(REPOSITORY)), name) for file in FILES for name in in_file(file)}
    assert not found, f'names of rclpy that are not public belong into {HOME.name}: {sorted(found)}'


def in_file(file: Path) -> Iterator[str]:
    yield from private_uses(file.read_text())
    for module in modules_of(file):
        if module.startswith('rclpy.impl') or (module.startswith('rclpy.') and '._' in module):
            yield module


def private_uses(source: str) -> Iterator[str]:
    """Give the names of rclpy that are not public and which a source uses of others or as a node itself."""
    tree = ast.parse(source)
    nodes = [each for each in ast.walk(tree) if isinstance(each, ast.ClassDef) and _bases(each) & NODES]
    own = {id(each) for kind in nodes for each in ast.walk(kind)}
    for each in ast.walk(tree):
        if isinstance(each, ast.Attribute):
            of_self = isinstance(each.value, ast.Name) and each.value.id in ('self', 'cls')
            if (each.attr == 'handle' and not of_self) or (
                each.attr in private_names() and (id(each) in own or not of_self)
            ):
                yield each.attr
        elif isinstance(each, ast.FunctionDef) and id(each) in own and each.name in private_names():
            yield each.name


def _bases(kind: ast.ClassDef) -> set[str]:
    return {ast.unparse(base).split('.')[-1].split('[')[0] for base in kind.bases}


@cache
def private_names() -> frozenset[str]:
    """Return the private attributes and methods of rclpy's classes, as other classes see them."""
    folder = Path(rclpy.__file__).parent
    found: set[str] = set()
    for file in (file for pattern in WHERE for file in folder.glob(pattern)):
        for kind in ast.walk(ast.parse(file.read_text())):
            if isinstance(kind, ast.ClassDef):
                found |= {_seen(name, kind.name) for name in _members(kind)}
    return frozenset(name for name in found if name.startswith('_') and not name.endswith('__'))


def _members(kind: ast.ClassDef) -> Iterator[str]:
    for each in ast.walk(kind):
        if isinstance(each, ast.FunctionDef):
            yield each.name
        elif isinstance(each, ast.Attribute) and ast.unparse(each.value) == 'self':
            yield each.attr


def _seen(name: str, kind: str) -> str:
    return f'_{kind.lstrip("_")}{name}' if name.startswith('__') and not name.endswith('__') else name
