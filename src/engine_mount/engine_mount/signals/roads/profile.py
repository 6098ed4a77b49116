"""A measured road: its height over the distance, and why one cannot be used."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.measured import Provenance

FloatArray = NDArray[np.float64]


class ProfileError(ValueError):
    """A road cannot be used; the text says which, where, why, and what would help."""


@dataclass(frozen=True, eq=False)
class RoadProfile:
    """Heights (n,) in m at places `spacing` m apart from `first` m on, under one track of wheels.

    `effective`: the heights are those that the axle feels, after the tyre has rounded the road. `notes` are
    sentences that say what was done to the file to get them.
    """

    first: float
    spacing: float
    height: FloatArray
    provenance: Provenance
    notes: tuple[str, ...] = ()
    effective: bool = False

    @property
    def distance(self) -> FloatArray:
        """Places (n,) in m."""
        return self.first + self.spacing * np.arange(self.height.size, dtype=np.float64)

    @property
    def length(self) -> float:
        """From the first place to the last, m."""
        return (self.height.size - 1) * self.spacing

    @property
    def name(self) -> str:
        """The file's name, for sentences."""
        return self.provenance.uri.rpartition('/')[2]
