"""Hills and drift taken out of a road: no mount feels waves of more than 100 m."""

import numpy as np

from engine_mount.signals.roads.profile import FloatArray

LONGEST_WAVE = 100.0
"""m, chosen: 0.33 Hz at 120 km/h, where wheel, body and engine move as one."""
_GAUSSIAN = (
    np.sqrt(np.log(2.0) / 2.0) / np.pi
)  # standard deviation over the wavelength that is halved (ISO 16610-21)


def without_long_waves(height: FloatArray, spacing: float) -> FloatArray:
    """Return heights (n,) in m, `spacing` m apart, without their line and waves of more than `LONGEST_WAVE`.

    A wave of that length is halved; one of a third of it is left within 1 %.
    """
    from scipy.ndimage import gaussian_filter1d

    places = np.arange(height.size) - 0.5 * (height.size - 1)
    slope = (places @ height) / (places @ places)
    level = height - height.mean() - slope * places
    return np.asarray(level - gaussian_filter1d(level, _GAUSSIAN * LONGEST_WAVE / spacing, mode='mirror'))
