"""Where the search for a force law begins: places derived from the points, whatever the actuator's size.

With a3 and a4 chosen, Eq (3) is linear in a1, a2 and a5, so these three follow from a linear fit.
"""

import itertools

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

from engine_mount.identification.actuator.points import Orders, gap_groups
from mount_models.actuator.law import TABLE_1

FloatArray = npt.NDArray[np.float64]


def starts(
    mapped_gap: FloatArray,
    current: FloatArray,
    force: FloatArray,
    tolerance: FloatArray,
    orders: Orders,
    domain: tuple[float, float],
) -> list[FloatArray]:
    """Return coefficients of a1 .. a5 to start from, in the gap mapped to -1 .. 1, the best first.

    `domain` holds the gaps (um) of -1 and 1. Table 1 is one of them where it can be.
    """
    highest = float(current.max())
    found: list[tuple[float, FloatArray]] = []
    for knee, lean, sharpness in itertools.product(_KNEES, _LEANS, _SHARPNESSES):
        sharp = _padded([sharpness / highest], orders[2])
        at = _padded([knee * highest, lean * knee * highest], orders[3])
        found.append(_completed(mapped_gap, current, force, tolerance, orders, sharp, at))
    by_gap = _gap_by_gap(mapped_gap, current, force, tolerance, orders)
    if by_gap is not None:
        found.append(_completed(mapped_gap, current, force, tolerance, orders, *by_gap))
    found.sort(key=lambda pair: pair[0])
    return [start for _, start in found[:_TRIED]] + [_table_1(orders, domain)]


_KNEES = (0.3, 0.45, 0.6, 0.8)  # chosen: current of the knee over the largest one, at the mean gap
_LEANS = (0.1, 0.3)  # chosen: the knee moves to higher currents with the gap
_SHARPNESSES = (4.0, 9.0, 18.0)  # chosen: a3 times the largest current
_GRID_KNEES = np.linspace(0.2, 0.9, 15)  # chosen, of each gap alone: a fine grid
_GRID_SHARPNESSES = np.array([3.0, 5.0, 8.0, 12.0, 18.0])
_TRIED = 3
_RIDGE = 1e-9


def _completed(
    mapped_gap: FloatArray,
    current: FloatArray,
    force: FloatArray,
    tolerance: FloatArray,
    orders: Orders,
    sharp: FloatArray,
    at: FloatArray,
) -> tuple[float, FloatArray]:
    """Return misfit and all coefficients for given polynomials a3 and a4."""
    sharpness = np.asarray(np.polynomial.polynomial.polyval(mapped_gap, sharp), np.float64)
    knee = np.asarray(np.polynomial.polynomial.polyval(mapped_gap, at), np.float64)
    lines, parabolas = _shapes(current, sharpness, knee)
    columns = [
        (shape / tolerance)[:, np.newaxis] * mapped_gap[:, np.newaxis] ** np.arange(order)
        for shape, order in ((lines, orders[0]), (lines * current, orders[1]), (parabolas, orders[4]))
    ]
    solution, misfit = _solved(np.concatenate(columns, axis=1), force / tolerance)
    a1, a2, a5 = np.split(solution, np.cumsum([orders[0], orders[1]]))
    return float(misfit), np.concatenate([a1, a2, sharp, at, a5])


def _gap_by_gap(
    mapped_gap: FloatArray, current: FloatArray, force: FloatArray, tolerance: FloatArray, orders: Orders
) -> tuple[FloatArray, FloatArray] | None:
    """Return polynomials a3 and a4 through the best knee of each gap on a grid, or None for too few gaps."""
    highest = float(current.max())
    grid = np.array(list(itertools.product(_GRID_KNEES, _GRID_SHARPNESSES)))
    grid = grid * (highest, 1.0 / highest)
    places, knees, sharpnesses = [], [], []
    for group in gap_groups(mapped_gap):
        # all trials of a gap at once: to solve them one by one takes about as long as the search that follows
        lines, parabolas = _shapes(current[group], grid[:, 1:], grid[:, :1])
        columns = np.stack([lines, lines * current[group], parabolas], axis=2)
        misfits = _solved(columns / tolerance[group, np.newaxis], force[group] / tolerance[group])[1]
        knee, sharpness = grid[np.argmin(misfits)]
        places.append(float(mapped_gap[group].mean()))
        knees.append(float(knee))
        sharpnesses.append(float(sharpness))
    if len(places) < 3:
        return None
    return (
        _padded([float(np.median(sharpnesses))], orders[2]),
        _padded(list(np.polynomial.polynomial.polyfit(places, knees, min(1, orders[3] - 1))), orders[3]),
    )


def _shapes(
    current: FloatArray, sharpness: FloatArray | float, knee: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
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


def _padded(values: list[float], order: int) -> FloatArray:
    return np.pad(np.asarray(values, float), (0, max(0, order - len(values))))[:order]


def _table_1(orders: Orders, domain: tuple[float, float]) -> FloatArray:
    """Return Table 1 in the mapped gap, cut to `orders`."""
    tables = (TABLE_1.a1, TABLE_1.a2, TABLE_1.a3, TABLE_1.a4, TABLE_1.a5)
    parts = []
    for table, order in zip(tables, orders, strict=True):
        mapped = Polynomial(table).convert(domain=domain, window=(-1.0, 1.0), kind=Polynomial).coef
        parts.append(_padded(list(mapped), order))
    return np.concatenate(parts)
