"""A chunk that is being filled with message records, and the indexes that say where these stand."""

import struct
import zlib
from collections.abc import Callable, Sequence

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Schema
from numpy.typing import NDArray

MESSAGE = struct.Struct('<BQHIQQ')  # opcode, length, channel, sequence, log time, publish time
MESSAGE_OPCODE = int(Opcode.MESSAGE)  # packed faster than the member of the enumeration
MESSAGE_HEAD = MESSAGE.size - 9  # what the length counts besides the payload
_INDEX = struct.Struct('<BQHI')  # opcode, length, channel, length of the entries

Entries = dict[int, list[int]]
"""For each channel log time (ns), offset, log time, offset, ... of its messages."""


class FilledChunk:
    """Records in their order; `entries` say of which messages, `size` is their length in bytes."""

    def __init__(self) -> None:
        self._declared: set[tuple[type, int]] = set()
        self.clear()

    def clear(self) -> None:
        """Begin the next chunk; what was declared in one is not declared in the next."""
        self.parts: list[bytes | memoryview] = []
        self.entries: Entries = {}
        self.size = 0

    @property
    def count(self) -> int:
        """How many messages there are."""
        return sum(len(entries) for entries in self.entries.values()) // 2

    def declare(self, declaration: Schema | Channel) -> None:
        """Add the record of a schema or a channel, unless it stands here or in a chunk before."""
        known = type(declaration), declaration.id
        if known not in self._declared:
            self._declared.add(known)
            data = packed(declaration)
            self.parts.append(data)
            self.size += len(data)

    def record(self, compress: Callable[[bytes], bytes]) -> Chunk:
        """Return the chunk, compressed by zstd; there must be a message."""
        data = b''.join(self.parts)
        times = [time for entries in self.entries.values() for time in entries[::2]]
        return Chunk(
            compression='zstd',
            data=compress(data),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )


class ColumnRecords:
    """Records of those columns that belong into one chunk, time by time.

    `columns` are the payloads, (times, bytes) for each of `channels`; `places` say where these stand among
    `count` columns, of which the others belong into other chunks; `times` in ns.
    """

    def __init__(
        self,
        chunk: FilledChunk,
        channels: Sequence[int],
        columns: Sequence[NDArray[np.uint8]],
        places: Sequence[int],
        count: int,
        times: NDArray[np.int64],
    ):
        records = [_records(channel, rows, times) for channel, rows in zip(channels, columns, strict=True)]
        self.chunk = chunk
        self._channels, self._places, self._times = channels, places, times
        self._data = memoryview(np.hstack(records).reshape(-1))  # type: ignore[arg-type]
        sizes = [rows.shape[1] for rows in records]
        self._bounds = np.concatenate([[0], np.cumsum(np.tile(sizes, len(times)))])  # of the records in data
        self._before = np.searchsorted(places, np.arange(count))  # own columns before each of all

    def filled_by(self, first: int, size: int) -> int:
        """Return behind which record, the chunk added to from `first` on, it has at least `size` bytes."""
        full = int(self._bounds[self._own(first)]) + size - self.chunk.size
        row, column = divmod(int(np.searchsorted(self._bounds, full)) - 1, len(self._channels))
        return row * len(self._before) + self._places[column] + 1

    def add(self, first: int, end: int) -> None:
        """Add to the chunk what of the records `first` .. `end` - 1 of all columns belongs there."""
        first, end = self._own(first), self._own(end)
        count, bounds = len(self._channels), self._bounds
        shift = self.chunk.size - int(bounds[first])
        for place in range(first, min(first + count, end)):
            found = np.arange(place, end, count)
            told = np.stack([self._times[found // count], bounds[found] + shift], 1)
            entries = self.chunk.entries.setdefault(self._channels[place % count], [])
            entries += told.reshape(-1).tolist()
        self.chunk.parts.append(self._data[int(bounds[first]) : int(bounds[end])])
        self.chunk.size += int(bounds[end] - bounds[first])

    def _own(self, place: int) -> int:
        """Return how many of the records before `place` are own ones."""
        row, column = divmod(place, len(self._before))
        return row * len(self._channels) + int(self._before[column])


def packed(record: McapRecord) -> bytes:
    """Return the bytes of a record."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def packed_index(channel: int, numbers: Sequence[int]) -> bytes:
    """Return the message index record of a channel's entries."""
    size = 8 * len(numbers)
    return _INDEX.pack(Opcode.MESSAGE_INDEX, size + 6, channel, size) + struct.pack(
        f'<{len(numbers)}Q', *numbers
    )


def _records(channel: int, rows: NDArray[np.uint8], times: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return one message record for each row of payload, (messages, bytes)."""
    records = np.empty((len(rows), MESSAGE.size + rows.shape[1]), np.uint8)
    head = MESSAGE.pack(MESSAGE_OPCODE, rows.shape[1] + MESSAGE_HEAD, channel, 0, 0, 0)
    records[:, : MESSAGE.size] = np.frombuffer(head, np.uint8)
    stamps = times.astype('<u8')[:, None].view(np.uint8)
    records[:, MESSAGE.size - 16 : MESSAGE.size - 8] = stamps
    records[:, MESSAGE.size - 8 : MESSAGE.size] = stamps
    records[:, MESSAGE.size :] = rows
    return records
