"""Where the search for a force law begins: places derived from the points, whatever the actuator's size.

With a3 and a4 chosen, Eq (3) is linear in a1, a2 and a5, so these three follow from a linear fit.
"""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyfit, polyval

from engine_mount.identification.actuator.points import Orders, gap_groups
from engine_mount.identification.fitting import FloatArray
from mount_models.actuator import TABLE_1

_KNEES = (0.3, 0.45, 0.6, 0.8)  # chosen: current of the knee over the largest one, at the mean gap
_LEANS = (0.1, 0.3)  # chosen: the knee moves to higher currents with the gap
_SHARPNESSES = (4.0, 9.0, 18.0)  # chosen: a3 times the largest current
_GRID_KNEES = np.linspace(0.2, 0.9, 15)  # chosen, of each gap alone: a fine grid
_GRID_SHARPNESSES = np.array([3.0, 5.0, 8.0, 12.0, 18.0])
_TRIED = 3
_RIDGE = 1e-9


class Problem(NamedTuple):
    """Points as the search sees them: gap mapped to -1 .. 1 (the gaps of `domain`, um), A, N, tolerance N."""

    gap: FloatArray
    current: FloatArray
    force: FloatArray
    tolerance: FloatArray
    orders: Orders
    domain: tuple[float, float]


def starts(problem: Problem) -> list[FloatArray]:
    """Return coefficients of a1 .. a5 in the mapped gap to start from, the best first, at last Table 1."""
    highest, orders = float(problem.current.max()), problem.orders
    trials = []
    for knee, lean, sharpness in itertools.product(_KNEES, _LEANS, _SHARPNESSES):
        at = [knee * highest, lean * knee * highest]
        trials.append((_padded([sharpness / highest], orders[2]), _padded(at, orders[3])))
    groups = gap_groups(problem.gap)
    if len(groups) >= 3:
        gaps = [float(problem.gap[group].mean()) for group in groups]
        best = np.array([_best_knee(problem, group) for group in groups])
        line = polyfit(gaps, best[:, 0], min(1, orders[3] - 1))
        trials.append((_padded([float(np.median(best[:, 1]))], orders[2]), _padded(line, orders[3])))
    ends = sorted((_completed(problem, *trial) for trial in trials), key=lambda end: end[0])
    table = TABLE_1.a1, TABLE_1.a2, TABLE_1.a3, TABLE_1.a4, TABLE_1.a5
    mapped = [
        Polynomial(part).convert(domain=problem.domain, window=(-1.0, 1.0), kind=Polynomial).coef
        for part in table
    ]
    table_1 = np.concatenate([_padded(part, order) for part, order in zip(mapped, orders, strict=True)])
    return [*(start for _, start in ends[:_TRIED]), table_1]


def _completed(problem: Problem, sharp: FloatArray, at: FloatArray) -> tuple[float, FloatArray]:
    """Return misfit and all coefficients for given polynomials a3 and a4."""
    gap, current, force, tolerance, orders, _ = problem
    lines, parabolas = _shapes(current, np.asarray(polyval(gap, sharp)), np.asarray(polyval(gap, at)))
    columns = [
        (shape / tolerance)[:, np.newaxis] * gap[:, np.newaxis] ** np.arange(order)
        for shape, order in ((lines, orders[0]), (lines * current, orders[1]), (parabolas, orders[4]))
    ]
    solution, misfit = _solved(np.concatenate(columns, axis=1), force / tolerance)
    a1, a2, a5 = np.split(solution, np.cumsum([orders[0], orders[1]]))
    return float(misfit), np.concatenate([a1, a2, sharp, at, a5])


def _best_knee(problem: Problem, group: FloatArray) -> FloatArray:
    """Return current and sharpness of the best knee of one gap on a grid."""
    highest = float(problem.current.max())
    grid = np.array(list(itertools.product(_GRID_KNEES, _GRID_SHARPNESSES))) * (highest, 1.0 / highest)
    current, tolerance = problem.current[group], problem.tolerance[group]
    # all trials of a gap at once: to solve them one by one takes about as long as the search that follows
    lines, parabolas = _shapes(current, grid[:, 1:], grid[:, :1])
    columns = np.stack([lines, lines * current, parabolas], axis=2)
    misfits = _solved(columns / tolerance[:, np.newaxis], problem.force[group] / tolerance)[1]
    return np.asarray(grid[np.argmin(misfits)])


def _shapes(current: FloatArray, sharpness: FloatArray, knee: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what multiplies the saturated line and a5 in Eq (3)."""
    low, bend = np.arctan(sharpness * knee), np.arctan(sharpness * (current - knee))
    return low + bend, current**2 * (low - bend)


def _solved(columns: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return linear fits, slightly held back where columns are alike, and their sums of squares.

    `columns` has shape (..., points, unknowns), `values` (points,).
    """
    scale = np.linalg.norm(columns, axis=-2)
    scale[scale == 0.0] = 1.0
    scaled = columns / scale[..., np.newaxis, :]
    across = np.swapaxes(scaled, -1, -2)
    normal = across @ scaled + _RIDGE * np.eye(scaled.shape[-1])
    solution = np.linalg.solve(normal, (across @ values)[..., np.newaxis])
    left = (scaled @ solution)[..., 0] - values
    return solution[..., 0] / scale, np.asarray(np.sum(left**2, axis=-1))


def _padded(values: FloatArray | list[float], order: int) -> FloatArray:
    return np.pad(np.asarray(values, float), (0, max(0, order - len(values))))[:order]
