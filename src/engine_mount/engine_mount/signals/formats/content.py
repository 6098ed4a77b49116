"""What every reader of a format offers: headings first, then the values of chosen columns."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from engine_mount.signals.formats.measured import Heading, MeasuredColumn


@dataclass(frozen=True)
class Stated:
    """What the caller says of a file that the file does not tell; empty or None: nothing.

    `rate` (Hz) is that of columns without any times. `decimal` is the decimal sign of a text table (`.` or
    `,`), `delimiter` what separates its cells (one sign, or `blank` for any number of blanks). `dbc` names
    the database by which CAN frames are decoded.
    """

    rate: float | None = None
    decimal: str = ''
    delimiter: str = ''
    dbc: Path | None = None


class Content(Protocol):
    """An opened file. `notes` are sentences on what was found, and grow while columns are read."""

    format: str
    reader: str
    headings: Sequence[Heading]
    notes: list[str]

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen columns in this order; raises `SignalError`."""
        ...
