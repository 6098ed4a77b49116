"""Times and chosen columns of topics, in one pass through a recording that keeps none of its messages."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.container.stored import StoredMessages
from engine_mount.recordings.messages.definitions import Definition, Field
from engine_mount.recordings.messages.series import Column, Heads, Series, SeriesError
from engine_mount.recordings.messages.times import Times

_HEADER = Field('std_msgs/Header')
_MOST_EXPECTED = 1 << 24  # chosen: a file may tell of any number of messages
_STAMP_AT, _STAMP_END = 4, 12  # bytes in the message: behind the kind of encoding


class GrowingColumn:
    """Numbers that are added block by block; pieces of a long column would fragment the memory."""

    def __init__(self, expected: int, kind: type[np.generic]):
        """Make room for so many numbers; more may come."""
        self._numbers = np.empty(min(expected, _MOST_EXPECTED), kind)
        self._count = 0

    def add(self, numbers: np.ndarray) -> None:
        """Add numbers behind the others."""
        begin, self._count = self._count, self._count + len(numbers)
        if self._count > len(self._numbers):
            self._numbers = np.resize(self._numbers, 2 * self._count)
        self._numbers[begin : self._count] = numbers

    @property
    def filled(self) -> np.ndarray:
        """All that was added."""
        return self._numbers[: self._count]


class ColumnCollector:
    """Collects columns and stamps of one topic; what is not in each message is left out."""

    def __init__(self, make_series: Callable[[StoredMessages], Series], names: Iterable[str], expected: int):
        """Take what makes a series of a block, the names of the columns, and how many messages come."""
        self._make_series = make_series
        self._columns = {name: GrowingColumn(expected, np.float64) for name in names}
        self._stamps: GrowingColumn | None = GrowingColumn(expected, np.int64)
        self._received = GrowingColumn(expected, np.int64)
        self._sequences = GrowingColumn(expected, np.uint32)

    def add(self, block: StoredMessages) -> None:
        """Take the messages in `block`."""
        series = self._make_series(block)
        self._received.add(series.receive_times)
        self._sequences.add(series.sequences)
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

    def finish(self) -> tuple[Heads, dict[str, Column], Times | None]:
        """Return the heads of all messages, the columns, and the stamps in ns, None where there are none."""
        heads = Heads(self._received.filled, self._sequences.filled, None)
        if not len(heads.received):
            return heads, {}, None
        columns: dict[str, Column] = {name: column.filled for name, column in self._columns.items()}
        return heads, columns, None if self._stamps is None else self._stamps.filled


@dataclass(frozen=True)
class TopicTimes:
    """Times in ns in the order of the recording; `obstacle` says why `stamps` are None.

    `receive_times` and `publish_times` are None where nobody needs them.
    """

    topic: str
    type: str
    count: int
    stamps: Times | None
    receive_times: Times | None
    publish_times: Times | None
    names: tuple[str, ...] = ()  # of the scalars in the first message of a JointState
    obstacle: str = ''

    def __len__(self) -> int:
        return self.count


class TimesCollector:
    """Collects the times of one topic, block by block."""

    def __init__(
        self,
        make_series: Callable[[StoredMessages], Series],
        definition: Definition | None,
        obstacle: str,
        wanted: Iterable[str],
        expected: int,
    ):
        """Take the definition, or the sentence why there is none; keep the `wanted` times of heads."""
        self._make_series = make_series
        self._obstacle = obstacle
        self._has_header = definition is not None and _begins_with_header(definition)
        self.count = 0
        self._stamps = GrowingColumn(expected if self._has_header else 0, np.int64)
        self._kept = {name: GrowingColumn(expected, np.int64) for name in wanted}
        self._names: tuple[str, ...] = ()

    def add(self, block: StoredMessages) -> None:
        """Take the times of the messages in `block`."""
        self.count += len(block)
        for name, times in self._kept.items():
            times.add(block.heads[name])
        if self._obstacle or not self._has_header:
            return
        if not self._names:
            self._names = _names_of(self._make_series(block.at(slice(1))))
        stamps = stamps_in(block)
        if stamps is None:
            self._obstacle = 'not every message begins with a stamp'
        else:
            self._stamps.add(stamps)

    def finish(self, topic: str, type_name: str) -> TopicTimes:
        """Return what was collected of a topic."""
        obstacle = self._obstacle or ('' if self._has_header else f'{type_name} has no header with a stamp')
        stamps = None if obstacle else self._stamps.filled
        kept = {name: times.filled for name, times in self._kept.items()}
        received, sent = kept.get('log_time'), kept.get('publish_time')
        return TopicTimes(topic, type_name, self.count, stamps, received, sent, self._names, obstacle)


def stamps_in(block: StoredMessages) -> Times | None:
    """Return the stamps (ns) of messages that begin with a header, None where one does not."""
    rows = block.beginnings(_STAMP_END)
    if rows is None or rows[:, 0].any() or (rows[:, 1] > 1).any():
        return None
    numbers = np.ascontiguousarray(rows[:, _STAMP_AT:])
    little, big = _read(numbers, '<'), rows[:, 1] == 0
    if big.any():
        little[big] = _read(numbers[big], '>')
    return little


def _read(stamps: NDArray[np.uint8], order: str) -> Times:
    """Return stamps (n, 8 bytes) in ns."""
    seconds = stamps.view(f'{order}i4')[:, 0].astype(np.int64)
    return np.asarray(seconds * 1_000_000_000 + stamps.view(f'{order}u4')[:, 1])


def _begins_with_header(definition: Definition) -> bool:
    header = next(iter(definition.types[definition.name].values()))
    first = next(iter(definition.types.get(_HEADER.kind, {}).values()), None)
    return header == _HEADER and first == Field('builtin_interfaces/Time')


def _names_of(series: Series) -> tuple[str, ...]:
    try:
        return series.names
    except ValueError:
        return ()
