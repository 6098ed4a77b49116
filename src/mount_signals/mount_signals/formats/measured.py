"""What any file of measured signals is read into: columns as the file holds them, none converted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Provenance:
    """Where a recording came from: URI, SHA-256 of its bytes, size in bytes, format, and what read it."""

    uri: str
    sha256: str
    size: int
    format: str
    reader: str


@dataclass(frozen=True, eq=False)
class TimeBase:
    """When the samples of a column were taken: s after `begin` (ns since 1970, or 0), shape (n,).

    `told` says in words where these times come from.
    """

    times: FloatArray
    begin: int
    told: str


@dataclass(frozen=True, eq=False)
class MeasuredColumn:
    """One column: its values (n,) in the file's own unit, NaN where the file holds none.

    `header` is its title as the file writes it, `name` that without the unit, `unit` as told there or ''.
    `time` is the time base where the format itself tells one, in s; None where a column holds it.
    """

    name: str
    header: str
    unit: str
    values: FloatArray
    time: TimeBase | None = None


@dataclass(frozen=True, eq=False)
class Measured:
    """A file as named columns, with what a reader must know: `notes` are sentences."""

    columns: Mapping[str, MeasuredColumn]
    provenance: Provenance
    notes: tuple[str, ...] = ()
