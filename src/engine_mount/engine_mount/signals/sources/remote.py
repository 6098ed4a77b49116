"""Recordings in a store that fsspec reaches: listed, and fetched through the local cache."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path, PurePosixPath

from engine_mount.signals.sources.cache import Cache, Held, default_limit
from engine_mount.signals.sources.fetching import fetch_file, reserve
from engine_mount.signals.sources.looking import Found, changed, look, look_inside, mark
from engine_mount.signals.sources.patience import Patience, persistent
from engine_mount.signals.sources.source import Entry, SourceError
from engine_mount.signals.sources.uris import checked, name_of, shown

Tell = Callable[[int, int], None]
"""Takes how many bytes are here, and of how many."""


def tell_nobody(done: int, of: int) -> None:
    """Tell nobody how far it is."""


class RemoteStore:
    """S3, Google Cloud Storage, SFTP and HTTP, asked again with `patience` where a connection breaks."""

    def __init__(self, patience: Patience | None = None):
        self._patience = patience or Patience()

    def entries(self, uri: str) -> Iterator[Entry]:
        """Return every file at or below `uri`, sorted by URI, hidden ones aside; raises `SourceError`."""
        return (found.entry for found in self.found(uri))

    def fetch(self, uri: str, scratch: Path) -> Path:
        """Return a whole local copy of the file or folder at `uri`, below `scratch`; raises `SourceError`.

        It is kept until this process ends.
        """
        return self.hold(uri, scratch).path

    def hold(self, uri: str, scratch: Path, tell: Tell = tell_nobody) -> Held:
        """Return a whole local copy that is kept until it is released; raises `SourceError`."""
        files = self.found(uri)
        if not files:
            raise SourceError(f'{shown(uri)}: an empty folder')
        size, done = sum(found.entry.size for found in files), 0

        def came(count: int) -> None:
            nonlocal done
            done += count
            tell(done, size)

        name = _safe(name_of(uri))

        def reserve_all(part: Path) -> None:
            for found in files:
                reserve(found, part / name / found.place)

        def fill(part: Path) -> None:
            for found in files:
                fetch_file(found, part / name / found.place, self._patience, came)
            if files[0].place.parts:
                now = persistent(uri, lambda: look_inside(uri), self._patience)
                if _identity(now) != _identity(files):
                    raise changed(uri)

        return Cache(scratch, default_limit()).hold(_identity(files), name, size, reserve_all, fill)

    def found(self, uri: str) -> Sequence[Found]:
        """Return the file at `uri`, or those in that folder with their places in it; raises `SourceError`."""
        checked(uri)

        def ask() -> Sequence[Found]:
            file = None if uri.endswith('/') else look(uri)
            return [file] if file else look_inside(uri)

        return persistent(uri, ask, self._patience)


def _identity(files: Sequence[Found]) -> str:
    """Return what is the same only while all files are as they are."""
    digest = hashlib.sha256()
    for found in files:
        digest.update(repr((found.entry.uri, str(found.place), *mark(found.entry))).encode())
    return digest.hexdigest()[:32]


def _safe(name: str) -> str:
    return name if PurePosixPath(name).name == name and name not in ('', '.', '..') else 'recording'
