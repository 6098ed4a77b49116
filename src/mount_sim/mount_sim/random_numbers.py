"""Random numbers that a seed repeats to the bit on every processor and under every version of numpy.

The whole numbers are those of PCG64, whose sequence numpy promises to keep. What is made of them here is
exact or passes `elementary`; numpy's own normal numbers pass the C library.
"""

import math
from collections.abc import Sequence

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import log, sine_and_cosine
from mount_models.arrays import FloatArray


class RandomNumbers:
    """A sequence of random numbers, told by its seed: a whole number or several."""

    def __init__(self, seed: int | Sequence[int]):
        self._source = np.random.PCG64(seed)

    def uniform(self, count: int) -> FloatArray:
        """Return the next numbers (count,), evenly distributed over 0 <= x < 1 in steps of 2^-53."""
        whole = np.asarray(self._source.random_raw(count), np.uint64)
        return np.asarray((whole >> np.uint64(11)) * 2.0**-53, np.float64)

    def normal(self, rows: int, columns: int) -> FloatArray:
        """Return the next numbers (rows, columns), normally distributed with standard deviation 1."""
        count = rows * columns
        return _normal(self.uniform(count + count % 2))[:count].reshape(rows, columns)


@compiled
def _normal(uniform):
    """Return normal numbers, as many as the even number of uniform ones (Box and Muller, 1958)."""
    result = np.empty(uniform.size)
    for k in range(0, uniform.size, 2):
        radius = math.sqrt(-2.0 * log(1.0 - uniform[k]))
        sine, cosine = sine_and_cosine(uniform[k + 1])
        result[k], result[k + 1] = radius * cosine, radius * sine
    return result
