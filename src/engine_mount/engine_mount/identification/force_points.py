"""Measured (gap, current, force) points: are they enough, plausible, and without outliers?"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial.polynomial import polyfit

from engine_mount.identification.fitting import FloatArray
from mount_models.quantity import LawRefusedError

ORDERS = (4, 4, 4, 2, 4)
"""Numbers of coefficients of a1 .. a5 in Table 1; together 18."""
_FEWEST_POINTS = 3 * sum(ORDERS)
_PARTS, _FEWEST_IN_PART = 8, 25  # chosen: noise often grows with the force
_SAME_GAP = 1e-6  # m, chosen
_FEWEST_CURRENTS = 8  # chosen: five coefficients and some to spare
_SMALLEST_SPAN = 0.1  # chosen: of the largest gap
_WEAK, _FEWEST_WEAK = 0.4, 5  # chosen: of the largest force of a gap; there the core hardly saturates
_NEAR_ZERO = 0.1  # of the largest current, chosen
_LARGEST_ZERO = 0.005  # of the largest force, chosen
_FAR = 6.0  # standard deviations, chosen: of 10^5 good points none
_FAR_TOLERANCES = 1.5, 10.0  # chosen: nearer no law of this form comes everywhere, further no noise goes
_MANY = 0.1  # chosen: that many are not outliers, something is wrong
_NAMED = 5


class ForcePoints(NamedTuple):
    """Measured points, rows of one length: gap (m), current (A), force (N)."""

    gap: FloatArray
    current: FloatArray
    force: FloatArray


def checked_points(gap: npt.ArrayLike, current: npt.ArrayLike, force: npt.ArrayLike) -> ForcePoints:
    """Return points of shapes that broadcast as rows of one length, or raise `LawRefusedError`."""
    arrays = np.broadcast_arrays(*(np.asarray(each, float) for each in (gap, current, force)))
    points = ForcePoints(*(np.ravel(array) for array in arrays))
    gaps, currents, forces = points
    if forces.size < _FEWEST_POINTS:
        raise LawRefusedError(
            f'force measurements ({forces.size}) must be at least {_FEWEST_POINTS}, three per coefficient; '
            'measure more gaps or currents'
        )
    if not np.isfinite(points).all():
        raise LawRefusedError('force measurements must be finite; leave out the points that failed')
    if currents.min() < 0.0 or currents.max() <= 0.0:
        raise LawRefusedError(
            f'coil currents ({currents.min():.3f} .. {currents.max():.3f} A) must be 0 A or more, and some '
            'above it; is the polarity of the current sensor right?'
        )
    if forces.max() <= 0.0 or np.mean(forces) < 0.0:
        raise LawRefusedError(
            f'forces ({forces.min():.1f} .. {forces.max():.1f} N) must be positive where the magnet pulls; '
            'is the sign of the load cell right?'
        )
    groups, needed = gap_groups(gaps), max(ORDERS) + 1
    held = len(groups) > 1  # else the gap was moved all the time
    steps = len(groups) if held else np.unique(gaps).size
    if steps < needed:
        raise LawRefusedError(
            f'force measurements must span at least {needed} air gaps, one more than the longest polynomial '
            f'has coefficients; {steps} given: measure more gaps'
        )
    if np.ptp(gaps) < _SMALLEST_SPAN * gaps.max():
        raise LawRefusedError(
            f'air gaps ({gaps.min() * 1e6:.1f} .. {gaps.max() * 1e6:.1f} um) must span at least '
            f'{_SMALLEST_SPAN:.0%} of the largest; measure over the whole way of the halves'
        )
    for group in groups if held else []:
        different = np.unique(np.round(currents[group], 4)).size
        if different < _FEWEST_CURRENTS:
            raise LawRefusedError(
                f'each air gap must be measured at {_FEWEST_CURRENTS} currents or more; at '
                f'{gaps[group].mean() * 1e6:.1f} um there are {different}: measure more, or leave this '
                'gap out'
            )
    return points


def check_zero(points: ForcePoints) -> None:
    """Raise `LawRefusedError` for forces that do not lead to 0 N at 0 A, by the weak ones of each gap."""
    zeros = []
    for group in gap_groups(points.gap):
        current, force = points.current[group], points.force[group]
        weak = force <= _WEAK * force.max()
        if weak.sum() >= _FEWEST_WEAK and current.min() <= _NEAR_ZERO * current.max():
            zeros.append(polyfit(current[weak] ** 2, force[weak], 2)[0])  # without remanence it is even
    zero, limit = float(np.median(zeros or [0.0])), _LARGEST_ZERO * points.force.max()
    # a load cell has the same zero at each gap
    if abs(zero) > max(limit, np.ptp(zeros or [0.0])):
        raise LawRefusedError(
            f'the force at 0 A ({zero:.2f} N by the weak currents) must lie within {limit:.2f} N of 0: set '
            'the zero of the load cell, or subtract this force; if it returns, the core is magnetised, which '
            'the law does not describe'
        )


def gap_groups(gap: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Return the places of points that share a gap (m), by rising gap; measured gaps may scatter a little."""
    order = np.argsort(gap, kind='stable')
    span = gap[order[-1]] - gap[order[0]]
    apart = np.diff(gap[order]) > max(_SAME_GAP, 0.01 * span)
    return np.split(order, np.flatnonzero(apart) + 1)


def check_outliers(points: ForcePoints, expected: FloatArray, tolerance: FloatArray) -> None:
    """Raise `LawRefusedError` naming the points whose force lies far from the `expected` one (N).

    Far is more than six standard deviations of points with like forces, and more than 1.5 `tolerance` (N),
    or more than 10.
    """
    misfit = np.abs(points.force - expected) / tolerance
    far = far_points(points.force, misfit)
    if not far.size:
        return
    worst = far[np.argsort(-misfit[far], kind='stable')][:_NAMED]
    named = [
        f'{points.gap[k] * 1e6:.1f} um, {points.current[k]:.3f} A: {points.force[k]:.1f} N, where '
        f'{expected[k]:.1f} N would fit'
        for k in worst
    ]
    if far.size > _MANY * misfit.size:
        raise LawRefusedError(
            f'{far.size} of {misfit.size} points lie far from any law of this form, the worst at {named[0]}: '
            'are gap, current and force of the same actuator, in the units of their columns, and taken at '
            'the same time?'
        )
    raise LawRefusedError(
        f'{far.size} of {misfit.size} points are outliers, off by more than {_FAR:.0f} standard deviations '
        f'of points with like forces: {"; ".join(named)}: measure them again, or leave them out'
    )


def far_points(force: FloatArray, misfit: FloatArray) -> npt.NDArray[np.intp]:
    """Return the places of outliers among misfits in units of their tolerance, by `force` (N)."""
    order = np.argsort(force, kind='stable')
    parts = np.array_split(order, max(1, min(_PARTS, force.size // _FEWEST_IN_PART)))
    middles = np.array([np.median(force[part]) for part in parts])
    scatters = np.array([1.4826 * np.median(misfit[part]) for part in parts])
    limit = np.clip(_FAR * np.interp(force, middles, scatters), *_FAR_TOLERANCES)
    return np.flatnonzero(misfit > limit)
