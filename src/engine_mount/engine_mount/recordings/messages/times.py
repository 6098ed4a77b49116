"""Times of messages in ns, and which of them are in others."""

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.int64]

NO_TIMES: Times = np.empty(0, np.int64)


def distinct(times: Times) -> Times:
    """Return the distinct times, rising; `np.unique` hashes them, which takes ten times as long."""
    if bool((times[1:] > times[:-1]).all()):
        return times
    times = ordered(times)
    return times[np.append(True, times[1:] > times[:-1])]


def ordered(times: Times) -> Times:
    """Return times sorted; no copy where they are."""
    return times if bool((times[1:] >= times[:-1]).all()) else np.sort(times)


def each_once(times: Times) -> tuple[Times, 'slice | NDArray[np.intp]']:
    """Return the distinct times, rising, and where the first of each stands; no copies where they rise."""
    if bool((times[1:] > times[:-1]).all()):
        return times, slice(None)
    return np.unique(times, return_index=True)


def is_in(times: Times, known: Times) -> NDArray[np.bool_]:
    """Return which of the times are among `known`, which rise."""
    if not len(known):
        return np.zeros(len(times), bool)
    return known[np.minimum(np.searchsorted(known, times), len(known) - 1)] == times
