"""Mean and standard deviation, summed from the first value to the last: numpy sums in an order of its own."""

import math

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
