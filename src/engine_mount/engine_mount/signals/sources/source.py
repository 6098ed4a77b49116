"""A file in a store, and the errors of stores."""

from dataclasses import dataclass


class SourceError(OSError):
    """A recording cannot be fetched; the text says from where, why, and what would help."""


class StoreAwayError(SourceError):
    """A store did not answer in any attempt; the text says how many there were."""


@dataclass(frozen=True)
class Entry:
    """A file in a store: its URI, size in bytes, and what changes when its content does.

    `modified` is in s since 1970 on a disk, else NaN; `etag` is the store's own mark, or its time of change.
    """

    uri: str
    size: int
    modified: float
    etag: str
