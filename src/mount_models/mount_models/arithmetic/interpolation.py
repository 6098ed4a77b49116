"""Straight lines between the points of a table."""

import numpy as np

from mount_models.arithmetic.compiled import compiled


@compiled
def interpolated(x, x_row, y_row):
    """Return y at `x` between the points (`x_row`, `y_row`), (n,) and x rising; constant beyond both ends."""
    low, high = 0, x_row.size - 1
    if not x > x_row[low]:
        return y_row[low] if x <= x_row[low] else x  # not a number stays it
    if x >= x_row[high]:
        return y_row[high]
    while high - low > 1:
        middle = (low + high) // 2
        if x_row[middle] <= x:
            low = middle
        else:
            high = middle
    share = (x - x_row[low]) / (x_row[high] - x_row[low])
    return y_row[low] + share * (y_row[high] - y_row[low])


@compiled
def each_interpolated(x, x_row, y_row):
    """Return `interpolated` at each of `x`, (m,)."""
    result = np.empty(x.size)
    for k in range(x.size):
        result[k] = interpolated(x[k], x_row, y_row)
    return result
