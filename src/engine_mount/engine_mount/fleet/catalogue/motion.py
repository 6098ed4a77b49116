"""What the displacement of a recording was."""

from typing import Any

import numpy as np

from engine_mount.fleet.catalogue.columns import BANDS, band_name
from engine_mount.fleet.catalogue.in_bands import FloatArray, in_bands
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.times import Times, each_once, misdated
from mount_ros.topics import DISPLACEMENT


def displacement_figures(displacement: Series, rate: float) -> dict[str, Any]:
    """Return peak and rms, of the whole displacement and in bands, {} where none is known; `rate` in Hz.

    Samples count in the order of their stamps, of several with the same stamp the first. Those that are
    misdated are left out: between them and the others there is nothing to look at.
    """
    try:
        stamps, values = displacement.stamps, displacement[DISPLACEMENT.names[0]]
    except SeriesError:
        return {}
    wrong = misdated(stamps)
    if wrong.any():
        stamps, values = stamps[~wrong], values[~wrong]
    rising, places = each_once(stamps)
    return motion_figures(rising, values[places], rate)


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
