"""Recordings by URI: listed, and fetched whole. A plain path is used unchanged, without loading a library."""

import atexit
import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from engine_mount.signals.sources.uris import Entry, SourceError, is_local, local_path

_kept: dict[Path, str] = {}
"""The copies that this process keeps, with their URIs."""
_held = contextlib.ExitStack()
atexit.register(_held.close)


def entries(uri: str) -> Iterator[Entry]:
    """Yield every file at or below `uri`, sorted by URI, hidden ones left out; raises `SourceError`."""
    if not is_local(uri):
        from engine_mount.signals.sources.remote import list_files

        yield from (entry for entry, _ in list_files(uri))
        return
    place = local_path(uri)
    found = (file for file in place.rglob('*') if not file.is_dir()) if place.is_dir() else [place]
    for path in sorted(found):
        if any(part.startswith('.') for part in path.relative_to(place).parts):
            continue
        try:
            status = path.stat()
        except OSError as error:
            raise SourceError(f'{path}: {error.strerror}') from None
        yield Entry(str(path), status.st_size, status.st_mtime, '')


def fetched(uri: str, progress: Callable[[int, int], None] = lambda done, of: None) -> Path:
    """Return a whole local copy of the file or folder at `uri`, kept until this process ends.

    A plain path and file:// are returned where they lie; `progress` takes how many bytes are here, and of
    how many. A loop over many recordings uses `local_copy`, whose copy can be removed. Raises `SourceError`.
    """
    path = _held.enter_context(local_copy(uri, progress))
    if not is_local(uri):
        _kept[path] = uri
    return path


@contextlib.contextmanager
def local_copy(uri: str, progress: Callable[[int, int], None] = lambda done, of: None) -> Iterator[Path]:
    """Give a whole local copy of the file or folder at `uri` for as long as the block lasts.

    Within the block nothing removes it; afterwards it stays in the cache until the room is needed.
    Raises `SourceError`.
    """
    if is_local(uri):
        place = local_path(uri)
        if not place.exists():
            raise SourceError(f'{place}: no such file or folder')
        yield place
        return
    from engine_mount.signals.sources.remote import remote_copy

    with remote_copy(uri, progress) as path:
        yield path


def uri_of(path: str | os.PathLike[str]) -> str:
    """Return the URI that `fetched` got the local `path` from, or what it lies in; '' for any other path."""
    return next((_kept[place] for place in (Path(path), *Path(path).parents) if place in _kept), '')
