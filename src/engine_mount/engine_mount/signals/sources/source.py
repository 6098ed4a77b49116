"""What a store of recordings must be able to do, whatever it is."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


class SourceError(OSError):
    """A recording cannot be fetched; the text says from where, why, and what would help."""


class StoreAwayError(SourceError):
    """A store did not answer, however often it was asked; the text says for how long."""


@dataclass(frozen=True)
class Entry:
    """A file in a store: its URI, size in bytes, and what changes when its content does.

    `modified` is in s since 1970, `etag` the store's own mark of the content; NaN and '' where it tells none.
    """

    uri: str
    size: int
    modified: float
    etag: str


class Source(Protocol):
    """One store, addressed by URIs of its own scheme."""

    def entries(self, uri: str) -> Iterator[Entry]:
        """Return every file at or below `uri`, sorted by URI; raises `SourceError`."""
        ...

    def fetch(self, uri: str, scratch: Path) -> Path:
        """Return a whole local copy of the file or folder at `uri`, below `scratch`; raises `SourceError`.

        A file that is already on this machine is returned where it lies.
        """
        ...
