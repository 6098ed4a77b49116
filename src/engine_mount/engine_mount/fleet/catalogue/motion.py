"""What the displacement of a recording was, collected part by part."""

from typing import Any

import numpy as np

from engine_mount.fleet.catalogue.columns import BANDS, band_name
from engine_mount.fleet.catalogue.in_bands import FloatArray, in_bands
from engine_mount.recordings.columns import ColumnPart
from engine_mount.recordings.times import Times, each_once, misdated
from mount_ros.topics import DISPLACEMENT


class Motion:
    """Stamps and displacement of all samples."""

    COLUMNS = DISPLACEMENT.names

    def __init__(self) -> None:
        self._stamps = [np.empty(0, np.int64)]
        self._values = [np.empty(0)]

    def add(self, part: ColumnPart) -> None:
        """Take a part of the topic."""
        self._values.append(part.column(DISPLACEMENT.names[0]))
        self._stamps.append(part.stamps)

    def figures(self, rate: float) -> dict[str, Any]:
        """Return peak and rms, of the whole displacement and in bands, {} where none is known."""
        return motion_figures(*self._by_stamps(), rate)

    def _by_stamps(self) -> tuple[Times, FloatArray]:
        """Return the samples in the order of their stamps, of several with the same stamp the first.

        Those that are misdated are left out: between them and the others there is nothing to look at.
        """
        stamps, values = np.concatenate(self._stamps), np.concatenate(self._values)
        wrong = misdated(stamps)
        if wrong.any():
            stamps, values = stamps[~wrong], values[~wrong]
        rising, places = each_once(stamps)
        return rising, values[places]


def motion_figures(stamps: Times, values: FloatArray, rate: float) -> dict[str, Any]:
    """Return peak and rms of displacements (m) with rising stamps, as a whole and in bands; `rate` in Hz."""
    known = values[np.isfinite(values)]
    if not known.size:
        return {}
    figures: dict[str, Any] = {
        'peak_displacement_m': float(np.abs(known).max()),
        'rms_displacement_m': float(np.std(known)),
    }
    for band, found in zip(BANDS, in_bands(stamps, values, rate, BANDS), strict=True):
        figures |= {band_name('peak', band): found.peak, band_name('rms', band): found.rms}
    return figures
