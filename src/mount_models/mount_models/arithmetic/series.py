"""Long series of numbers of which only the part in use is in memory."""

from collections.abc import Callable

import numpy as np

from mount_models.arrays import FloatArray


class StreamedSeries:
    """Numbers (n,) made when a part of them is asked for: `series[first:behind]` is an array.

    `make` gives the numbers `first` .. `behind` - 1; each has to be the same to the bit in whatever part.
    """

    def __init__(self, count: int, make: Callable[[int, int], FloatArray]):
        self._count = count
        self._make = make

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, part: slice) -> FloatArray:
        first, behind, _ = part.indices(self._count)
        return self._make(first, behind) if first < behind else np.empty(0)

    def cut(self, count: int) -> 'StreamedSeries':
        """Return its first numbers, at most `count`."""
        return StreamedSeries(min(count, self._count), self._make)


def series_of(values: FloatArray) -> StreamedSeries:
    """Return `values` (n,), which are in memory, as a series."""
    return StreamedSeries(len(values), lambda first, behind: values[first:behind])


def series_over_time(count: int, step_time: float, at: Callable[[FloatArray], FloatArray]) -> StreamedSeries:
    """Return the series of what `at` gives for the times 0, `step_time`, .. in s."""
    return StreamedSeries(
        count, lambda first, behind: at(step_time * np.arange(first, behind, dtype=np.float64))
    )
