"""Compile a law to machine code once per change of its source, and keep the result on disk.

numba's own cache watches only the file of the compiled function: after a change in a law that
this function calls, it would go on running the old law without a word. Here the folder of the
cache carries a digest of all sources of the function's package, of the packages of this project that
its file imports, and of `mount_models`, which every package may call, so a change anywhere leads to a
new folder.
"""

import contextlib
import functools
import hashlib
import importlib.util
import os
import re
import types
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config as numba_config
from numba.core import event as numba_event

F = TypeVar('F', bound=Callable[..., Any])

_DESK = 'engine_mount'
"""The one package of which each room counts as a package here: it changes more often than its laws do."""
_MODELS = Path(__file__).resolve().parents[1]
_OURS = re.compile(r'^\s*(?:from|import)\s+(mount_\w+|engine_mount\.\w+)', re.MULTILINE)


def compiled(function: F) -> F:
    """Return `function` compiled by numba on its first call and cached on disk."""
    return _compiled(function, _packages_behind(_file_of(function)))


def specialised(function: F, name: str, bound: Mapping[str, Any]) -> F:
    """Return `function` compiled with other values of the global names in `bound`, and cached on disk.

    `name` tells it from the same function with other values. Modules in `bound` are part of what a change
    makes compile anew.
    """
    clone = types.FunctionType(
        function.__code__, {**function.__globals__, **bound}, function.__name__, function.__defaults__
    )
    clone.__qualname__ = f'{name}.{function.__qualname__}'
    packages = set(_packages_behind(_file_of(function)))
    for value in bound.values():
        if isinstance(value, types.ModuleType) and value.__file__ is not None:
            packages.update(_packages_behind(Path(value.__file__).resolve()))
    return cast(F, _compiled(clone, tuple(sorted(packages))))


@contextlib.contextmanager
def compilation_told(tell: Callable[[str], object]) -> Iterator[None]:
    """Call `tell` with a sentence before the first compilation within the block; not where all is on disk."""
    with numba_event.install_listener('numba:compile', _Teller(tell)):
        yield


class _Teller(numba_event.Listener):
    def __init__(self, tell: Callable[[str], object]):
        self._tell, self._told = tell, False

    def on_start(self, event: numba_event.Event) -> None:
        if not self._told:
            self._told = True
            self._tell('compiling laws for this machine, once after a build (up to half a minute)')

    def on_end(self, event: numba_event.Event) -> None:
        pass


def _compiled(function: F, packages: tuple[Path, ...]) -> F:
    config: Any = numba_config  # numba reads the folder when it decorates
    before = config.CACHE_DIR
    config.CACHE_DIR = str(_cache_root() / _sources_digest(packages))
    try:
        # inlined: a call costs more than many a law, for arrays are counted at each (7 % of a core drive)
        return cast(F, numba.njit(cache=True, error_model='numpy', forceinline=True)(function))
    finally:
        config.CACHE_DIR = before


def _file_of(function: Callable[..., Any]) -> Path:
    return Path(function.__code__.co_filename).resolve()


def _package_folder(file: Path) -> Path:
    folder = file.parent
    while (folder.parent / '__init__.py').exists() and folder.parent.name != _DESK:
        folder = folder.parent
    return folder


@functools.cache
def _packages_behind(file: Path) -> tuple[Path, ...]:
    """Return the folders of all packages whose code a function in `file` may call."""
    folders = {_package_folder(file), _MODELS}
    for name in set(_OURS.findall(file.read_text(encoding='utf-8'))):
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            folders.add(Path(spec.origin).resolve().parent)
    return tuple(sorted(folders))


@functools.cache
def _sources_digest(packages: tuple[Path, ...]) -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for folder in packages:
        for source in sorted(folder.rglob('*.py')):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_root() -> Path:
    base = os.environ.get('XDG_CACHE_HOME') or str(Path.home() / '.cache')
    return Path(base) / 'engine_mount' / 'compiled'
