"""What the displacement of a recording was, collected part by part."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from engine_mount.recordings.bag.column_parts import ColumnPart
from engine_mount.recordings.messages.compact_times import CompactTimes, compact
from engine_mount.recordings.messages.packed_column import PackedColumn, packed
from engine_mount.recordings.messages.stamps import misdated
from mount_recorder.stamp_watch import FARTHEST
from mount_replay.fleet.catalogue.columns import BANDS, band_name
from mount_replay.fleet.catalogue.in_bands import FloatArray, in_bands
from mount_ros.topics import DISPLACEMENT


class Motion:
    """Stamps and displacement of all samples: some 4 bytes each of what comes by CAN, at most 10."""

    COLUMNS = DISPLACEMENT.names

    def __init__(self) -> None:
        self._stamps = CompactTimes()
        self._values = PackedColumn()

    def add(self, part: ColumnPart) -> None:
        """Take a part of the topic."""
        self._values.add(part.column(DISPLACEMENT.names[0]))
        self._stamps.add(part.stamps)

    def figures(self, rate: float) -> dict[str, Any]:
        """Return peak and rms, of the whole displacement and in bands, {} where none is known."""
        return motion_figures(*self._by_stamps(), rate)

    def _by_stamps(self) -> tuple[CompactTimes, PackedColumn]:
        """Return the samples in the order of their stamps, of several with the same stamp the first.

        Those that are misdated are left out: between them and the others there is nothing to look at.
        """
        stamps, values = self._stamps.finished(), self._values.finished()
        if stamps.longest_step > FARTHEST:
            told = stamps.whole()
            sound = ~misdated(told)
            stamps, values = compact(told[sound]), packed(values.whole()[sound])
        if stamps.strictly_rising:
            return stamps, values
        rising, theirs = CompactTimes(), PackedColumn()
        for numbers in stamps.overlapping():
            found, first = np.unique(stamps.whole(numbers), return_index=True)
            rising.add(found)
            theirs.add(values.whole(numbers)[first])
        return rising.finished(), theirs.finished()


def motion_figures(stamps: CompactTimes, values: PackedColumn, rate: float) -> dict[str, Any]:
    """Return peak and rms of displacements (m) with rising stamps, as a whole and in bands; `rate` in Hz."""
    count = sum(map(len, _known(values)))
    if not count:
        return {}
    mean = math.fsum(float(piece.sum()) for piece in _known(values)) / count
    square = math.fsum(float(np.square(piece - mean).sum()) for piece in _known(values))
    figures: dict[str, Any] = {
        'peak_displacement_m': max(float(np.abs(piece).max(initial=0.0)) for piece in _known(values)),
        'rms_displacement_m': math.sqrt(square / count),
    }
    for band, found in zip(BANDS, in_bands(stamps, values, rate, BANDS), strict=True):
        figures |= {band_name('peak', band): found.peak, band_name('rms', band): found.rms}
    return figures


def _known(values: PackedColumn) -> Iterator[FloatArray]:
    """Yield the numbers among the values, piece by piece."""
    return (piece[np.isfinite(piece)] for piece in values.blocks())
