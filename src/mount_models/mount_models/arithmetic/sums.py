"""Mean, straight lines in a table and small least squares: every sum from the first value to the last.

numpy and LAPACK add in an order of their own, which depends on the processor; these do not."""

import math

import numpy as np

from mount_models.arithmetic.compiled import compiled


@compiled
def mean(values):
    """Return the mean of `values`, (n,); NaN of none."""
    total = 0.0
    for value in values:
        total += value
    return total / values.size


@compiled
def standard_deviation(values):
    """Return the standard deviation of the distribution that `values`, (n,), are drawn from; NaN of one."""
    middle, total = mean(values), 0.0
    for value in values:
        total += (value - middle) * (value - middle)
    return math.sqrt(total / (values.size - 1))


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


@compiled
def least_squares(matrix, values):
    """Return (x, R): the x, (k,), that makes |matrix x - values| least, and the upper triangle R, (k, k).

    `matrix` is (n, k) with n >= k, `values` (n,). (R^T R)^-1 is the covariance of x for values whose standard
    deviation is 1. Where the columns depend on each other, x is not finite.
    """
    columns = matrix.shape[1]
    left, right = matrix.copy(), values.copy()
    for k in range(columns):
        _reflect(left, right, k)
    solution = np.empty(columns)
    for k in range(columns - 1, -1, -1):
        rest = right[k]
        for j in range(k + 1, columns):
            rest -= left[k, j] * solution[j]
        solution[k] = rest / left[k, k]
    triangle = np.zeros((columns, columns))
    for k in range(columns):
        triangle[k, k:] = left[k, k:]
    return solution, triangle


@compiled
def combination_std(triangle, weights):
    """Return the standard deviation of sum_k weights_k x_k, `weights` (k,), for the R of `least_squares`.

    It is the length of y in R^T y = weights.
    """
    unknowns = weights.size
    y = np.empty(unknowns)
    total = 0.0
    for k in range(unknowns):
        rest = weights[k]
        for j in range(k):
            rest -= triangle[j, k] * y[j]
        y[k] = rest / triangle[k, k]
        total += y[k] * y[k]
    return math.sqrt(total)


@compiled
def _reflect(left, right, k):
    """Reflect the rows from `k` on so that column `k` of `left` vanishes below the diagonal."""
    rows, columns = left.shape
    square = 0.0
    for i in range(k, rows):
        square += left[i, k] * left[i, k]
    # away from the first element, so that nothing cancels
    diagonal = -math.copysign(math.sqrt(square), left[k, k])
    first = left[k, k] - diagonal
    if first == 0.0:
        return
    left[k, k] = first
    scale = -1.0 / (diagonal * first)  # 2 / |v|^2, v = column k from row k on
    for j in range(k + 1, columns):
        product = 0.0
        for i in range(k, rows):
            product += left[i, k] * left[i, j]
        for i in range(k, rows):
            left[i, j] -= product * scale * left[i, k]
    product = 0.0
    for i in range(k, rows):
        product += left[i, k] * right[i]
    for i in range(k, rows):
        right[i] -= product * scale * left[i, k]
    left[k, k] = diagonal
