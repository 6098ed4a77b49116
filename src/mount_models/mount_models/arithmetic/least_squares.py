"""Small least squares in plain arithmetic: LAPACK's last bits depend on the processor, these do not.

A = Q R by Householder's reflections (Golub, Van Loan, *Matrix Computations*, section 5.3), every sum from the
first row to the last.
"""

import math

import numpy as np

from mount_models.arithmetic.compiled import compiled


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
