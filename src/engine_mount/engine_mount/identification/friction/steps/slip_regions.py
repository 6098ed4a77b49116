"""Where in a recording the contact sticks in part, and where all of it slides."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.identification.friction.recording import FrictionRecording
from engine_mount.identification.friction.steps.sawtooth import sliding_window, strokes
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import FADED_BELOW

BoolArray = npt.NDArray[np.bool_]


class SlipRegions(NamedTuple):
    """Which samples (n,) are microslip, which macroslip, and which slide too slowly for the simplified model.

    The last 10 ms before a turning point are none of them: noise and smoothing may blur it.
    """

    micro: BoolArray
    macro: BoolArray
    faded: BoolArray


def slip_regions(recording: FrictionRecording, contact: FrictionContact) -> SlipRegions:
    """Return the regions; macroslip is where step 2 looks, at `FADED_BELOW` or faster."""
    regions = SlipRegions(*(np.zeros(recording.force.size, bool) for _ in range(3)))
    for first, last, velocity in strokes(recording):
        window = sliding_window(recording, contact, first, last, velocity)
        regions.micro[first : min(window.start, last)] = True
        (regions.faded if abs(velocity) < FADED_BELOW else regions.macro)[window] = True
    return regions
