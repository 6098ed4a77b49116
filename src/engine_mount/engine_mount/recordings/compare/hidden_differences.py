"""Which messages of a topic differ in what no signal shows: arrays, texts, numbers beside the signals."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.messages.layout import Layout, Numbers

Rows = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Place = tuple[str, int]
"""A number or a text of a message: its path, and its place in a run of numbers."""

_NONE = Numbers(0, np.dtype('u1'), 0)


def hidden_differences(a: Layout, rows_a: Rows, b: Layout, rows_b: Rows, shown: Collection[Place]) -> Mask:
    """Return which rows (messages x bytes) of A differ from those of B in what is not `shown`.

    Unknown (NaN) in both is equal; bytes between the numbers do not count.
    """
    texts = [path for path in a.strings.keys() | b.strings.keys() if (path, 0) not in shown]
    if any(a.strings.get(path) != b.strings.get(path) for path in texts):
        return np.ones(len(rows_a), bool)  # the texts of a layout are those of all its messages
    different = np.zeros(len(rows_a), bool)
    for path in a.numbers.keys() | b.numbers.keys():
        one, other = a.numbers.get(path, _NONE), b.numbers.get(path, _NONE)
        hidden = [place for place in range(max(one.count, other.count)) if (path, place) not in shown]
        if hidden and one.count != other.count:
            return np.ones(len(rows_a), bool)
        if hidden:
            different |= ~_same(_run(one, rows_a), _run(other, rows_b))[:, hidden].all(axis=1)
    return different


def _run(numbers: Numbers, rows: Rows) -> NDArray:
    """Return a run of numbers, messages x numbers."""
    size = numbers.count * numbers.dtype.itemsize
    return np.ascontiguousarray(rows[:, numbers.offset : numbers.offset + size]).view(numbers.dtype)


def _same(a: NDArray, b: NDArray) -> Mask:
    if a.dtype.kind == b.dtype.kind == 'f':
        return ((a == b) & (np.signbit(a) == np.signbit(b))) | (np.isnan(a) & np.isnan(b))
    return np.asarray(a == b)
