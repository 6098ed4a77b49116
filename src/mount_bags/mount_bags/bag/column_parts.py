"""Columns of topics straight from the unpacked chunks of a file, part by part: for many or long recordings.

A compiled function walks the records of a chunk and picks the wanted bytes of each message. It takes one
only if everything that fixes its layout is as in the first one of its topic; a chunk with any other goes the
general way of `Recording.parts`, which gives the same numbers.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mount_bags.container.chunks import LENGTH_BESIDES_PAYLOAD, MESSAGE_HEAD, RECORD, Chunk
from mount_bags.container.mcap_file import McapFile
from mount_bags.messages.series import STAMP_BYTES, Column, Series, Times
from mount_bags.messages.taken import LOG_TIME_PLACE, take

if TYPE_CHECKING:
    from mount_bags.bag.recording import Recording

_WORD = 8  # bytes of a number that is picked
_HEADS = 2  # numbers before the columns in a row: log time and stamp
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
    recording: 'Recording', columns: Mapping[str, tuple[str, ...]], size: int
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
        self._picked: dict[str, _Picked] = {}

    def parts(self) -> Iterator[ColumnPart]:
        for chunk in self._file.passing():
            held = [name for name in self._wanted if not self._held_in(chunk).isdisjoint(self._numbers[name])]
            if not held:
                continue
            if not self._take(chunk, held):
                yield from self._flushed()
                yield from self._read(chunk)
            yield from self._flushed(self._size)
        yield from self._flushed()

    def _held_in(self, chunk: Chunk) -> frozenset[int]:
        assert chunk.channels is not None  # of a plain file
        return chunk.channels

    def _take(self, chunk: Chunk, held: list[str]) -> bool:
        """Take a chunk into the rows, all of it or nothing; return whether it is taken."""
        if any(name not in self._picked for name in held):
            return False
        content = self._file.unpacked(chunk)
        if content is None:
            return False
        data = np.frombuffer(content, np.uint8)
        filled = {name: self._picked[name].take(data) for name in held}
        if any(count < 0 for count in filled.values()):
            return False
        for name, count in filled.items():
            self._picked[name].filled = count
        return True

    def _read(self, chunk: Chunk) -> Iterator[ColumnPart]:
        """Read a chunk the general way, and learn from it the layout of topics not seen before."""
        contents = self._file.contents(chunk)
        if contents is None:
            return
        for name, numbers in self._numbers.items():
            found = contents.messages.of(np.array(numbers, np.int64))
            if not len(found):
                continue
            series = self._recording.series_of(name, found)
            if name not in self._picked and len(numbers) == 1:
                picked = _picked(series, self._wanted[name], numbers[0], self._size)
                if picked is not None:
                    self._picked[name] = picked
            yield _part_of(series, self._wanted[name])

    def _flushed(self, least: int = 1) -> Iterator[ColumnPart]:
        """Yield what stands in the rows of the topics that have at least so many."""
        for name, picked in self._picked.items():
            if picked.filled >= least:
                yield picked.flushed(name)


class _Picked:
    """Rows of the wanted bytes of one topic's messages, and where these stand in a message."""

    def __init__(
        self,
        channel: int,
        names: tuple[str, ...],
        places: list[int],
        raw: bytes,
        shape: NDArray[np.int64],
        size: int,
    ):
        head = MESSAGE_HEAD.itemsize
        self.filled = 0
        self._channel, self._names = channel, names
        self._length = LENGTH_BESIDES_PAYLOAD + len(raw)
        self._places = np.array([LOG_TIME_PLACE, *(head + place for place in places)], np.int64)
        self._shape = np.zeros((2, len(raw)), np.uint8)
        self._shape[0] = np.frombuffer(raw, np.uint8)
        self._shape[1, shape] = 255
        self._rows = np.empty((size, _WORD * len(self._places)), np.uint8)

    def take(self, data: NDArray[np.uint8]) -> int:
        """Return how many rows there are with the messages in `data`; negative if one is another."""
        needed = self.filled + len(data) // (RECORD.size + self._length) + 1
        if needed > len(self._rows):
            rows = np.empty((2 * needed, self._rows.shape[1]), np.uint8)
            rows[: self.filled] = self._rows[: self.filled]
            self._rows = rows
        return take(data, self._channel, self._shape, self._places, self._rows, self.filled)

    def flushed(self, topic: str) -> ColumnPart:
        """Return the rows as columns and begin anew."""
        rows = self._rows[: self.filled].copy()
        self.filled = 0
        log_times = rows[:, :_WORD].copy().view('<i8')[:, 0]
        seconds, nanoseconds = (
            rows[:, begin : begin + STAMP_BYTES // 2].copy().view(kind)[:, 0].astype(np.int64)
            for begin, kind in ((_WORD, '<i4'), (_WORD + STAMP_BYTES // 2, '<u4'))
        )
        numbers = rows[:, _WORD * _HEADS :].copy().view(_FLOAT)
        columns = {name: numbers[:, place].copy() for place, name in enumerate(self._names)}
        return ColumnPart(topic, seconds * 1_000_000_000 + nanoseconds, log_times, columns)


def _picked(series: Series, names: tuple[str, ...], channel: int, size: int) -> _Picked | None:
    """Return rows for messages like those of `series`, None where they cannot be picked."""
    layout, place = series.layout, series.stamp_place
    position = layout.numbers.get('position') if layout is not None else None
    if layout is None or place is None or position is None or position.dtype != _FLOAT:
        return None
    if position.count != len(series.names):
        return None
    known = tuple(name for name in names if name in series.names)
    places = [place, *(position.offset + _WORD * series.names.index(name) for name in known)]
    return _Picked(channel, known, places, series.payloads[0], layout.shape, size)
