"""Cubics through four neighbouring samples at any distances, in an order of arithmetic of their own.

The error of a sine of frequency f at even distances T is below 0.024 (2 pi f T)^4 of its amplitude.
"""

import numpy as np

from engine_mount.signals.signal import FloatArray
from mount_models.arithmetic.compiled import compiled


@compiled
def interpolated(times: FloatArray, values: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the values at `grid` (m,), rising, between samples at `times` (n,), strictly rising, n >= 4.

    They leave the range of their four samples by no more than half of that range, whatever the distances:
    a cubic through close samples on either side of a gap would else throw itself far out.
    """
    result = np.empty(grid.size)
    right = 1
    for place in range(grid.size):
        while right < times.size - 1 and times[right] < grid[place]:
            right += 1
        first = min(max(right - 2, 0), times.size - 4)
        near = values[first : first + 4]
        low, high = near.min(), near.max()
        margin = 0.5 * (high - low)
        value = _cubic(times[first : first + 4], near, grid[place])
        result[place] = min(max(value, low - margin), high + margin)
    return result


@compiled
def prediction_error(times: FloatArray, values: FloatArray, chosen: np.ndarray) -> float:
    """Return the sum of squares by which the two samples on either side miss each `chosen` (n,) sample.

    The times under which samples foretell each other best are those at which they were taken.
    """
    around, near = np.empty(4), np.empty(4)
    total = 0.0
    for place in range(2, times.size - 2):
        if not chosen[place]:
            continue
        for number in range(4):
            neighbour = place + number - 2 + number // 2
            around[number], near[number] = times[neighbour], values[neighbour]
        total += (_cubic(around, near, times[place]) - values[place]) ** 2
    return total


@compiled
def _cubic(times: FloatArray, values: FloatArray, at: float) -> float:
    """Return Lagrange's cubic through four samples."""
    result = 0.0
    for one in range(4):
        weight = 1.0
        for other in range(4):
            if other != one:
                weight *= (at - times[other]) / (times[one] - times[other])
        result += weight * values[one]
    return result
