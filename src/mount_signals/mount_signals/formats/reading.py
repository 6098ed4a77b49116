"""The front door: any file of measured signals as named columns with unit, time base and provenance."""

from collections.abc import Sequence
from pathlib import Path

from mount_signals.formats.content import Stated
from mount_signals.formats.measured import Heading, Measured


def read(uri: str | Path, columns: Sequence[str] | None = None, stated: Stated | None = None) -> Measured:
    """Return the columns of the file or folder at `uri`, only those that `columns` name where given.

    Raises `SignalError` or `SourceError` with one sentence: file, place, value, what was expected, remedy.
    """
    raise NotImplementedError


def headings(uri: str | Path, stated: Stated | None = None) -> tuple[Heading, ...]:
    """Return which columns the file or folder at `uri` has, without their values; raises as `read`."""
    raise NotImplementedError
