"""The files of the packages, and what they import."""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
SOURCES = REPOSITORY / 'src'
PACKAGES = sorted(file.parent.name for file in SOURCES.glob('*/setup.py'))
ROS_PACKAGES = [name for name in PACKAGES if (SOURCES / name / 'package.xml').is_file()]
LOADERS = ('import_module', 'importlib.import_module', 'importlib.resources.files', 'required')


@cache
def modules_of(file: Path) -> tuple[str, ...]:
    """Return what a file imports, inside functions too; a name that is imported may be a module itself."""
    return tuple(_imported(file))


def module_files() -> dict[str, Path]:
    """Return the file of every module of the packages."""
    return {
        '.'.join(file.relative_to(SOURCES / package).with_suffix('').parts).removesuffix('.__init__'): file
        for package in PACKAGES
        for file in (SOURCES / package / package).rglob('*.py')
    }


def files_behind(begin: Iterable[Path]) -> set[Path]:
    """Return the files of the packages that these files load, themselves included."""
    modules, found, left = module_files(), set(), set(begin)
    while left:
        file = left.pop()
        found.add(file)
        left |= {modules[name] for name in _with_parents(modules_of(file)) if name in modules} - found
    return found


def _with_parents(names: Iterable[str]) -> Iterator[str]:
    for name in names:
        parts = name.split('.')
        yield from ('.'.join(parts[:count]) for count in range(1, len(parts) + 1))


def _imported(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f'{node.module}.{alias.name}' for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in LOADERS:
            yield from (name.value for name in node.args[:1] if isinstance(name, ast.Constant))
