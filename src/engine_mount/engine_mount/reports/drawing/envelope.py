"""Fewer points of a long curve without hiding any peak of it."""

import numpy as np

from engine_mount.reports.drawing.chart import Array


def envelope(x: Array, y: Array, points: int) -> tuple[Array, Array]:
    """Return at most `points` points of the curve `y` over rising `x`, its extremes among them.

    The samples are taken in groups of equal number; of each the lowest and the highest are kept where they
    stand. A group without a number stays unknown (NaN), one with some unknown samples keeps what is known.
    Curves that are short enough are returned as they are.
    """
    if points < 4:
        raise ValueError(f'an envelope of {points} points is no curve; it needs at least 4')
    count = len(x)
    if count <= points:
        return x, y
    size = -(-count // (points // 2))
    begins = np.arange(0, count, size)
    lowest = np.minimum.reduceat(np.where(np.isnan(y), np.inf, y), begins)
    highest = np.maximum.reduceat(np.where(np.isnan(y), -np.inf, y), begins)
    group = np.arange(count) // size
    places = np.concatenate([_first(y == lowest[group], group), _first(y == highest[group], group)])
    unknown = begins[lowest > highest]
    kept = np.unique(np.concatenate([places, unknown]))
    return x[kept], y[kept]


def _first(is_extreme: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Return the first place of each group at which `is_extreme`."""
    places = np.flatnonzero(is_extreme)
    _, first = np.unique(group[places], return_index=True)
    return places[first]
