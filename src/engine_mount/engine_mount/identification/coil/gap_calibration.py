"""Gap curves with their uncertainty from ripple recorded at known gaps, one recording for each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_mount.identification.coil.curve_fit import CurveFit, fitted_curve, inverse_curve
from engine_mount.identification.coil.gap_point import GapPoint
from engine_mount.identification.single_threaded import single_threaded
from mount_models.coil.gap import GapCurves, check_gap_curves
from mount_models.quantity import LawRefusedError

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class GapCalibration:
    """The four curves that the controller takes, and the two fits over the gap that they come from."""

    curves: GapCurves
    inductance: CurveFit
    crossing: CurveFit
    points: tuple[GapPoint, ...]


@single_threaded
def calibrate_gap_curves(points: Sequence[GapPoint], highest_degree: int = 5) -> GapCalibration:
    """Return the curves through points at one temperature, both ways.

    The degree is the lowest that predicts each point from the others nearly as well as the best one. Raises
    `LawRefusedError` for too few gaps, a point that contradicts the others, or curves not monotone.
    """
    points = sorted(points, key=lambda point: point.gap)
    gaps = np.array([point.gap for point in points])
    _check_gaps(gaps)

    def fitted(what: str, value: str, std: str) -> CurveFit:
        values, stds = (np.array([getattr(point, name) for point in points]) for name in (value, std))
        return fitted_curve(what, points, values, stds, highest_degree)

    inductance = fitted(_INDUCTANCE, 'inductance', 'inductance_std')
    crossing = fitted(_CROSSING, 'crossing_current', 'crossing_std')
    curves = GapCurves(
        inductance.polynomial,
        inverse_curve(_INDUCTANCE, inductance.polynomial),
        crossing.polynomial,
        inverse_curve(_CROSSING, crossing.polynomial),
    )
    check_gap_curves(curves)
    return GapCalibration(curves, inductance, crossing, tuple(points))


_INDUCTANCE, _CROSSING = 'inductance at the rest current', 'crossing current'
_FEWEST_GAPS = 6  # chosen: a cubic and two to judge it


def _check_gaps(gaps: FloatArray) -> None:
    if gaps.size < _FEWEST_GAPS or np.any(np.diff(gaps) < 1e-6):
        raise LawRefusedError(
            f'gap curves need recordings at {_FEWEST_GAPS} or more air gaps that differ by 1 um or more; '
            f'{gaps.size} given: {", ".join(f"{gap * 1e6:.1f}" for gap in gaps)} um: record more gaps, and '
            f'each temperature and gap once'
        )
