"""Columns of topics straight from the unpacked chunks of a file, part by part: for many or long recordings.

A compiled function walks the records of chunks and picks the wanted numbers of each message. It takes one
only if everything that fixes its layout is as in the first one of its topic; a chunk with any other goes the
general way of `Recording.parts`, which gives the same numbers.
"""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.bag.file_blocks import unpacked_together
from engine_mount.recordings.container.mcap_reading.chunk_table import Places
from engine_mount.recordings.container.mcap_reading.chunks import MESSAGE_HEAD
from engine_mount.recordings.container.mcap_reading.mcap_file import McapFile
from engine_mount.recordings.messages.series import Column, Series, Times
from engine_mount.recordings.messages.taken import LOG_TIME_PLACE, WORD, Wanted, take

if TYPE_CHECKING:
    from engine_mount.recordings.bag.recording import Recording

PART = 1 << 13
"""Messages of a topic in a part, chosen: where nothing asks for more or fewer."""
_FLOAT = np.dtype('<f8')


@dataclass(frozen=True, eq=False)
class ColumnPart:
    """Messages of a topic in the order of the file: stamps and log times (ns), and columns that each has."""

    topic: str
    stamps: Times
    receive_times: Times
    columns: Mapping[str, Column]

    def __len__(self) -> int:
        return len(self.stamps)

    def column(self, name: str) -> Column:
        """Return a column; NaN where its messages have none of that name."""
        return self.columns[name] if name in self.columns else np.full(len(self), np.nan)


def column_parts(
    recording: 'Recording', columns: Mapping[str, tuple[str, ...]], size: int = PART
) -> Iterator[ColumnPart]:
    """Yield columns of topics, {topic: names}, in the order of the files, some `size` messages at a time."""
    wanted = {recording.resolve(topic): names for topic, names in columns.items()}
    files = recording.files
    plain = [file for file in files if isinstance(file, McapFile) and file.plain]
    if len(plain) < len(files):
        for series in recording.parts(wanted, size):
            yield _part_of(series, wanted[series.topic])
        return
    for file in plain:
        yield from _FileColumns(recording, file, wanted, size).parts()


def _part_of(series: Series, names: tuple[str, ...]) -> ColumnPart:
    columns = {name: series[name] for name in names if name in series.names}
    return ColumnPart(series.topic, series.stamps, series.receive_times, columns)


class _FileColumns:
    """The columns of one file."""

    def __init__(
        self, recording: 'Recording', file: McapFile, wanted: Mapping[str, tuple[str, ...]], size: int
    ):
        self._recording, self._file, self._wanted, self._size = recording, file, wanted, size
        self._numbers = {name: recording.numbers_in(file, name) for name in wanted}
        kinds = [kind.channels or frozenset() for kind in file.chunks.kinds]  # all told in a plain file
        self._held = [{name for name in wanted if not kind.isdisjoint(self._numbers[name])} for kind in kinds]
        self._known = np.zeros(len(kinds), np.bool_)  # whether all that is wanted of a kind can be picked
        self._columns = _Columns(size)
        self._unpacker = file.unpacker()

    def parts(self) -> Iterator[ColumnPart]:
        chunks = self._file.chunks
        numbers = {number for known in self._numbers.values() for number in known}
        for places in unpacked_together(self._file, chunks.holding(numbers)):
            yield from self._parts_of(places)
        yield from self._columns.flushed()

    def _parts_of(self, places: Places) -> Iterator[ColumnPart]:
        """Yield the parts that some chunks fill, together as far as all that is wanted of them is known."""
        while len(places):
            known = self._known[self._file.chunks.rows['kind'][places]]
            count = len(places) if known.all() else int(known.argmin())
            yield from self._taken(places[:count]) if count else self._read(places[0])
            places = places[max(count, 1) :]

    def _taken(self, places: Places) -> Iterator[ColumnPart]:
        """Yield the parts that chunks fill; one whose messages are others is read the general way."""
        content, ends = self._unpacker.unpacked(places)
        taken = 0
        while taken < len(places):
            if taken < len(ends):
                taken = self._columns.take(content, ends, taken)
            if self._columns.full:
                yield from self._columns.flushed(self._size)
            elif taken < len(places):
                yield from self._read(places[taken])
                taken += 1

    def _read(self, place: np.int64) -> Iterator[ColumnPart]:
        """Read a chunk the general way, and learn from it the layout of topics not seen before."""
        yield from self._columns.flushed()
        contents = self._file.contents(self._file.chunks[int(place)])
        if contents is None:
            return
        for name, numbers in self._numbers.items():
            found = contents.messages.of(np.array(numbers, np.int64))
            if not len(found):
                continue
            series = self._recording.series_of(name, found)
            if len(numbers) == 1 and not self._columns.know({name}):
                picked = _picked(series, self._wanted[name], numbers[0])
                if picked is not None:
                    self._columns.learn(name, picked)
                    self._known[:] = [self._columns.know(held) for held in self._held]
            yield _part_of(series, self._wanted[name])


@dataclass(frozen=True, eq=False)
class _Picked:
    """Where log time, stamp and wanted numbers of one topic stand in a record, and how its messages look."""

    channel: int
    names: tuple[str, ...]
    places: list[int]
    raw: bytes
    shape: NDArray[np.int64]  # bytes of the message that are the same in all

    @property
    def marked(self) -> NDArray[np.uint8]:
        """The bytes of `shape` as a mask, (bytes,)."""
        mask = np.zeros(len(self.raw), np.uint8)
        mask[self.shape] = 255
        return mask


class _Columns:
    """The wanted numbers of several topics' messages, filled chunk by chunk."""

    def __init__(self, size: int):
        self._size = size
        self._topics: dict[str, _Picked] = {}

    def know(self, names: Set[str]) -> bool:
        """Return whether messages of all these topics can be taken."""
        return self._topics.keys() >= names

    def learn(self, name: str, picked: _Picked) -> None:
        """Take messages of one more topic; nothing must be filled."""
        self._topics[name] = picked
        topics = list(self._topics.values())
        counts = [(len(topic.raw), len(topic.places)) for topic in topics]
        self._wanted = Wanted(
            np.array([topic.channel for topic in topics]),
            np.cumsum([(0, 0), *counts], axis=0),
            np.frombuffer(b''.join(topic.raw for topic in topics), np.uint8),
            np.concatenate([topic.marked for topic in topics]),
            np.concatenate([topic.places for topic in topics]),
        )
        self._shortest = MESSAGE_HEAD.itemsize + min(size for size, _ in counts)
        self._filled = np.zeros(len(topics), np.int64)
        self._numbers = np.empty((len(topics), max(count for _, count in counts), 0), np.int64)

    @property
    def full(self) -> bool:
        """Whether a topic has as many messages as a part."""
        return bool(self._filled.max() >= self._size)

    def take(self, content: NDArray[np.uint8], ends: NDArray[np.int64], first: int) -> int:
        """Take the messages in chunks, which end at `ends` in `content`, from the `first` on; return how far.

        It ends before a chunk with a message unlike those before, and behind the one with which a part is
        `full`.
        """
        needed = self._size + int(ends[-1]) // self._shortest + 1
        if needed > self._numbers.shape[2]:
            rows = np.empty((*self._numbers.shape[:2], 2 * needed), np.int64)
            rows[:, :, : self._numbers.shape[2]] = self._numbers
            self._numbers = rows
        return take(content, ends, first, self._size, *self._wanted, self._numbers, self._filled)

    def flushed(self, least: int = 1) -> Iterator[ColumnPart]:
        """Yield the messages of the topics that have at least so many, and begin these anew."""
        for place, (name, topic) in enumerate(self._topics.items()):
            count = int(self._filled[place])
            if count < least:
                continue
            log_times, stamps, *numbers = self._numbers[place, : len(topic.places), :count].copy()
            self._filled[place] = 0
            seconds, nanoseconds = (stamps << 32) >> 32, (stamps >> 32) & 0xFFFFFFFF
            columns = {each: number.view(_FLOAT) for each, number in zip(topic.names, numbers, strict=True)}
            yield ColumnPart(name, seconds * 1_000_000_000 + nanoseconds, log_times, columns)


def _picked(series: Series, names: tuple[str, ...], channel: int) -> _Picked | None:
    """Return where the numbers of messages like those of `series` stand, None where they cannot be picked."""
    layout, place = series.layout, series.stamp_place
    position = layout.numbers.get('position') if layout is not None else None
    if layout is None or place is None or position is None or position.dtype != _FLOAT:
        return None
    if position.count != len(series.names):
        return None
    known = tuple(name for name in names if name in series.names)
    places = [place, *(position.offset + WORD * series.names.index(name) for name in known)]
    in_record = [LOG_TIME_PLACE, *(MESSAGE_HEAD.itemsize + each for each in places)]
    return _Picked(channel, known, in_record, series.payloads[0], layout.shape)
