"""Tell whether a force law can be inverted: positive, rising with current, falling with gap."""

import numpy as np
import numpy.typing as npt

from mount_models.actuator.law import ForceLaw, checked_force

FloatArray = npt.NDArray[np.float64]


class ForceLawRefusedError(ValueError):
    """A force law is not usable, or measurements lead to none; the text says why and the remedy."""


def check_force_law(law: ForceLaw, lowest_current: float = 0.0) -> None:
    """Raise `ForceLawRefusedError` unless `law` can be inverted everywhere within its guarded range.

    Looked at on 61 gaps and 119 currents from 1/60 of the highest up; below, the force is next to nothing.
    With a `lowest_current` (A) above that, from there up only.
    """
    if not (0.0 < law.gap_low < law.gap_high and law.current_high > 0.0):
        raise ForceLawRefusedError(
            f'guarded range ({law.gap_low * 1e6:.1f} .. {law.gap_high * 1e6:.1f} um, '
            f'0 .. {law.current_high:.2f} A) must hold gaps above 0 in rising order '
            'and currents above 0 A'
        )
    gaps = np.linspace(law.gap_low, law.gap_high, 61)
    currents = np.linspace(max(LOWEST_SHARE * law.current_high, lowest_current), law.current_high, 119)
    forces = checked_force(law, currents, gaps[:, np.newaxis])
    # written so that NaN fails each of them
    _refuse_where(~(forces > 0.0), gaps, currents, 'be positive')
    _refuse_where(~(np.diff(forces, axis=1) > 0.0), gaps, currents, 'rise with current')
    _refuse_where(~(np.diff(forces, axis=0) < 0.0), gaps, currents, 'fall with the air gap')


LOWEST_SHARE = 1.0 / 60.0
"""Of the highest current, chosen: 0.05 A of 3 A."""


def _refuse_where(failed: npt.NDArray[np.bool_], gaps: FloatArray, currents: FloatArray, what: str) -> None:
    if failed.any():
        row, column = np.argwhere(failed)[0]
        raise ForceLawRefusedError(
            f'the force must {what}; at {gaps[row] * 1e6:.0f} um and {currents[column]:.2f} A this law does '
            f'not: narrow its range of gaps, measure more points, or look for outliers'
        )
