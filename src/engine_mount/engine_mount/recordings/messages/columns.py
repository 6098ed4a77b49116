"""Chosen columns of a topic, taken block by block: a long recording needs the memory of these alone."""

from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.container.scratch import put_away, room
from engine_mount.recordings.container.stored import StoredMessages
from engine_mount.recordings.messages.compact_times import CompactTimes
from engine_mount.recordings.messages.series import (
    Column,
    Heads,
    Payloads,
    Series,
    SeriesError,
    Times,
    heads_of,
)

Kind = TypeVar('Kind', np.float64, np.int64)

_BLOCK = 4096  # messages, chosen: 3 MB of the longest ones of this project
_PUT_AWAY = 1 << 17  # messages, chosen: 1 MB of each column is in memory while it fills

MakeSeries = Callable[[Payloads, Heads], Series]
"""Makes a series of messages and their heads."""


class FillingColumn(Generic[Kind]):
    """A column that fills part by part: never held twice where not more comes than is expected.

    A long one is in a file (`scratch`).
    """

    def __init__(self, expected: int, kind: type[Kind]):
        """Make room for so many numbers; more may come."""
        self._numbers = room(expected, kind)
        self._count = 0

    def add(self, numbers: NDArray[Kind]) -> None:
        """Add numbers behind the others."""
        begin, self._count = self._count, self._count + len(numbers)
        if self._count > len(self._numbers):
            self._numbers = np.concatenate([self._numbers[:begin], np.empty(self._count, numbers.dtype)])
        self._numbers[begin : self._count] = numbers

    @property
    def filled(self) -> NDArray[Kind]:
        """All that was added."""
        return self._numbers[: self._count]


class ColumnCollector:
    """Collects columns and stamps of one topic; what is not in each message is left out."""

    def __init__(self, make_series: MakeSeries, names: Iterable[str], expected: int):
        """Take what makes a series of a block, the names, and how many messages are expected."""
        self._make_series = make_series
        self._columns = {name: FillingColumn(expected, np.float64) for name in names}
        self._stamps: FillingColumn[np.int64] | None = FillingColumn(expected, np.int64)
        self._heads = Heads(CompactTimes(), CompactTimes(), CompactTimes())
        self._waiting: list[np.ndarray | list[bytes]] = []
        self._waiting_heads: list[np.ndarray] = []
        self._count = self._taken = 0

    def add(self, block: StoredMessages) -> None:
        """Take the messages in `block`."""
        self._waiting.append(block.payloads())
        self._waiting_heads.append(block.heads)
        self._count += len(block)
        if self._count >= _BLOCK:
            self._take()

    def finish(self) -> tuple[Heads, dict[str, Column], Times | None]:
        """Return the heads of all messages, the columns, and the stamps in ns, None where there are none."""
        if self._count:
            self._take()
        if not len(self._heads.received):
            return self._heads, {}, None
        columns: dict[str, Column] = {name: column.filled for name, column in self._columns.items()}
        stamps = None if self._stamps is None else self._stamps.filled
        for times in self._heads:
            times.finished()
        return self._heads, columns, stamps

    def _take(self) -> None:
        heads = heads_of(np.concatenate(self._waiting_heads))
        series = self._make_series(Payloads(self._waiting), heads)
        self._heads.received.add(heads.received.whole())
        self._heads.sequences.add(heads.sequences.whole())
        self._waiting, self._waiting_heads, self._count = [], [], 0
        self._taken += len(series)
        if self._taken >= _PUT_AWAY:
            put_away()
            self._taken = 0
        for name in list(self._columns):
            try:
                self._columns[name].add(series[name])
            except SeriesError:
                del self._columns[name]
        if self._stamps is not None:
            try:
                self._stamps.add(series.stamps)
            except SeriesError:
                self._stamps = None
