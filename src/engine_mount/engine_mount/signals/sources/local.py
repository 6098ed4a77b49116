"""Recordings on a disk of this machine: read where they lie."""

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from engine_mount.signals.sources.source import Entry, SourceError
from engine_mount.signals.sources.uris import is_uri


class LocalStore:
    """Plain paths and file:// URIs."""

    def entries(self, uri: str) -> Iterator[Entry]:
        """Return every file at or below `uri`, sorted by URI, hidden ones aside; raises `SourceError`."""
        place = local_path(uri)
        found = sorted(_files(place)) if place.is_dir() else [place]
        for path in found:
            try:
                told = path.stat()
            except OSError as error:
                raise SourceError(f'{path}: {error.strerror}') from None
            yield Entry(str(path), told.st_size, told.st_mtime, '')

    def fetch(self, uri: str, scratch: Path) -> Path:
        """Return where it lies; nothing is copied; raises `SourceError` where there is nothing."""
        place = local_path(uri)
        if not place.exists():
            raise SourceError(f'{place}: no such file or folder')
        return place


def local_path(uri: str) -> Path:
    """Return what a file:// URI or a plain path means; raises `SourceError` for another machine's."""
    if not is_uri(uri):
        return Path(uri)
    parts = urlsplit(uri)
    if parts.netloc not in ('', 'localhost'):
        raise SourceError(
            f'{uri} names the machine {parts.netloc}; a path of this machine has three slashes, as in file:///data/a.mcap'
        )
    return Path(unquote(uri.partition('://')[2].removeprefix(parts.netloc)))


def _files(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith('.')]
        yield from (Path(place, name) for name in names if not name.startswith('.'))
