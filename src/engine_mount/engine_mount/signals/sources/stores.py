"""Recordings by URI: listed, fetched whole, or only as far as their summary needs.

A plain path goes through unchanged, without loading any library.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from engine_mount.signals.sources.local import LocalStore
from engine_mount.signals.sources.source import Entry, Source
from engine_mount.signals.sources.uris import is_uri, scheme_of

if TYPE_CHECKING:
    from engine_mount.signals.sources.cache import Held
    from engine_mount.signals.sources.reading import Traffic
    from engine_mount.signals.sources.remote import Tell

_kept: dict[Path, tuple[str, 'Held']] = {}
"""The copies that this process holds, with their URIs."""


def source_of(uri: str) -> Source:
    """Return the store that `uri`, or a plain path, lies in; raises `SourceError` for an unknown scheme."""
    if is_local(uri):
        return LocalStore()
    from engine_mount.signals.sources.remote import RemoteStore

    return RemoteStore()


def entries(uri: str) -> Iterator[Entry]:
    """Return every file at or below `uri`, sorted by URI, hidden ones aside; raises `SourceError`."""
    return source_of(uri).entries(uri)


def fetched(uri: str, scratch: Path | None = None, tell: 'Tell | None' = None) -> Path:
    """Return a whole local copy of the file or folder at `uri`, kept until this process ends.

    A plain path and file:// are returned where they lie, others below `scratch`, by default the cache of
    this user. Who goes through many recordings takes `local_copy`, which gives the place free again.
    Raises `SourceError`.
    """
    if is_local(uri):
        return LocalStore().fetch(uri, scratch or Path())
    held = _hold(uri, scratch, tell)
    if held.path in _kept:
        held.release()
    else:
        _kept[held.path] = uri, held
    return held.path


@contextlib.contextmanager
def local_copy(uri: str, scratch: Path | None = None, tell: 'Tell | None' = None) -> Iterator[Path]:
    """Give a whole local copy of the file or folder at `uri` for as long as the block lasts.

    Within the block nothing removes it; afterwards it stays in the cache until the room is needed.
    Raises `SourceError`.
    """
    if is_local(uri):
        yield LocalStore().fetch(uri, scratch or Path())
        return
    held = _hold(uri, scratch, tell)
    try:
        yield held.path
    finally:
        held.release()


@contextlib.contextmanager
def outline(uri: str, scratch: Path | None = None) -> Iterator[Path]:
    """Give what stands at the ends of a recording, for listing: summaries, metadata and session.

    The files have their names and sizes, but what was not read of an MCAP file is a hole in them; they are
    gone when the block ends. A plain path and file:// are given whole, as is what has no sound summary.
    Raises `SourceError`.
    """
    if is_local(uri):
        yield LocalStore().fetch(uri, scratch or Path())
        return
    from engine_mount.signals.sources.outlines import outlined

    with outlined(uri) as path:
        if path is not None:
            yield path
            return
    with local_copy(uri, scratch) as whole:
        yield whole


def uri_of(path: str | os.PathLike[str]) -> str:
    """Return the URI that `fetched` got the local `path` from, or what it lies in; '' for any other path."""
    for place in (Path(path), *Path(path).parents):
        if place in _kept:
            return _kept[place][0]
    return ''


def traffic() -> 'Traffic':
    """Return what this process took from stores so far: bytes and requests; local files are none."""
    from engine_mount.signals.sources import reading

    return reading.traffic()


def is_local(uri: str) -> bool:
    """Return whether `uri` is a path or file://; raises `SourceError` for an unknown scheme."""
    return not is_uri(uri) or scheme_of(uri) == 'file'


def _hold(uri: str, scratch: Path | None, tell: 'Tell | None') -> 'Held':
    from engine_mount.signals.sources.cache import default_folder
    from engine_mount.signals.sources.remote import RemoteStore, tell_nobody

    return RemoteStore().hold(uri, scratch or default_folder(), tell or tell_nobody)
