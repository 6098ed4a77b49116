"""Is it a road? Heights in another unit and accelerations are refused, with a guess what they are."""

import numpy as np

from engine_mount.signals.roads.iso8608 import Unevenness
from engine_mount.signals.roads.long_waves import without_long_waves
from engine_mount.signals.roads.profile import FloatArray, ProfileError, RoadProfile

SMOOTHEST, ROUGHEST = 5e-5, 0.25
"""m, chosen: rms of waves shorter than 100 m; a tenth of a new motorway's, and class G of ISO 8608."""
_FLAT_SPECTRUM = 0.5  # chosen: waviness below; of roads it is 1.5 to 3.5, of accelerations of a car about 0
_HIGH_STONES = 0.03  # m, chosen: rms up to which a flat spectrum is that of a pavement of stones
_UNITS = (('mm', 1e-3), ('cm', 1e-2), ('um', 1e-6), ('in', 0.0254), ('m', 1.0), ('km', 1e3))


def check_heights(profile: RoadProfile, unit: str, factor: float) -> None:
    """Raise `ProfileError` unless heights given in `unit`, `factor` m, may be those of a road."""
    rms = root_mean_square(without_long_waves(profile.height, profile.spacing))
    if rms == 0.0:
        raise ProfileError(f'{profile.name}: all heights are the same; is this column the height?')
    if SMOOTHEST <= rms <= ROUGHEST:
        return
    fits = [word for word, size in _UNITS if word != unit and SMOOTHEST <= rms / factor * size <= ROUGHEST]
    guess = f'; are they in {" or ".join(fits[:3])} instead of {unit}?' if fits else ''
    what = 'rougher than any road' if rms > ROUGHEST else 'smoother than any road'
    raise ProfileError(
        f'{profile.name}: waves up to 100 m have a height of {rms:.3g} m rms, {what} ({SMOOTHEST:g} .. '
        f'{ROUGHEST:g} m, chosen){guess}'
    )


def check_displacement(profile: RoadProfile, found: Unevenness) -> None:
    """Raise `ProfileError` where the heights are in truth an acceleration, by the shape of their spectrum."""
    rms = root_mean_square(without_long_waves(profile.height, profile.spacing))
    if found.waviness < _FLAT_SPECTRUM and rms > _HIGH_STONES:
        raise ProfileError(
            f'{profile.name}: a waviness of {found.waviness:.2f} with {rms:.3g} m rms is not that of heights '
            '(1.5 to 3.5) but of accelerations (about 0); if it is one, drive it with --scenario recorded, '
            'or make a road of it with engine-mount road invert'
        )


def root_mean_square(values: FloatArray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))
