"""Writes the MCAP container: chunks with CRC and message indexes, and a summary at the end.

The records around the messages are those of the `mcap` package. The messages themselves and their
indexes are packed here: `mcap.writer.Writer` makes an object of each, which limits it to a quarter of the
messages per second (measured). A chunk and its indexes reach the file in one write, so every state
of the file ends with a whole record.
"""

import struct
import zlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from mount_bags.container.record_file import RecordFile

CHUNK_SIZE = 64 * 1024  # bytes before compression, chosen: what a crash may cost
_COMPRESSION_LEVEL = 1  # chosen: level 3 makes these messages no smaller (7.85 for 7.87 MB measured)
_MESSAGE = struct.Struct('<BQHIQQ')  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_OPCODE = int(Opcode.MESSAGE)  # packed faster than the member of the enumeration
_MESSAGE_HEAD = _MESSAGE.size - 9  # what the length counts besides the payload
_INDEX = struct.Struct('<BQHI')  # opcode, length, channel, length of the entries
_ROOM_PER_CHUNK = 96  # bytes of a chunk index without its channels, rounded up
_ROOM_AT_LEAST = 64 * 1024  # bytes, chosen: metadata of the recording, statistics, footer


class ChunkedMcap:
    """One MCAP file, written from `start` to `finish`; every `OSError` leaves whole records behind."""

    def __init__(self, file: RecordFile, chunk_size: int = CHUNK_SIZE):
        self.file = file
        self.message_counts: dict[int, int] = {}  # of the chunks that are in the file
        self.start_time: int | None = None  # ns, earliest log time in the file
        self.end_time: int | None = None
        self.after_chunk: Callable[[], None] = _nothing  # called when a chunk has reached the file
        self._chunk_size = chunk_size
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunk_count = 0
        self._metadata_indexes: list[MetadataIndex] = []
        self._attachment_indexes: list[AttachmentIndex] = []
        self._written_schemas: set[int] = set()
        self._written_channels: set[int] = set()
        self._data_crc = 0
        self._room = _ROOM_AT_LEAST
        self._clear_chunk()

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return sum(len(entries) for entries in self._entries.values()) // 2

    @property
    def room_needed(self) -> int:
        """How many bytes one more chunk and the end of the file need, estimated from above."""
        return self._chunk_size + self._room

    def start(self, profile: str, library: str) -> None:
        """Write the head of the file and hold back room for its end."""
        self._append(MCAP0_MAGIC + _packed(Header(profile, library)))
        self.file.keep_room(self._room)

    def add_schema(self, name: str, encoding: str, text: bytes) -> int:
        """Declare a schema and return its id; it is written with the first message that needs it."""
        schema = Schema(id=len(self._schemas) + 1, data=text, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._room += 2 * len(_packed(schema))
        return schema.id

    def add_channel(self, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """Declare a channel and return its id; it is written with its first message."""
        number = len(self._channels) + 1
        channel = Channel(
            id=number, topic=topic, message_encoding=encoding, metadata=dict(metadata), schema_id=schema_id
        )
        self._channels.append(channel)
        self._room += 4 * len(_packed(channel))
        return number

    def add_message(
        self, channel: int, raw: bytes, log_time: int, publish_time: int, sequence: int = 0
    ) -> None:
        """Add one serialised message; times in ns. A full chunk goes to the file at once."""
        entries = self._entries.get(channel)
        if entries is None:
            entries = self._open_entries(channel)
        length = len(raw)
        entries += (log_time, self._size)
        self._parts += (
            _MESSAGE.pack(_MESSAGE_OPCODE, length + _MESSAGE_HEAD, channel, sequence, log_time, publish_time),
            raw,
        )
        self._size += length + _MESSAGE.size
        if self._size >= self._chunk_size:
            self.flush()

    def add_columns(
        self, channels: Sequence[int], columns: Sequence[NDArray[np.uint8]], times: NDArray[np.int64]
    ) -> None:
        """Add a message of each channel for each of `times` (ns), log time and publish time in one.

        `columns` are their payloads, (times, bytes) for each channel, of which each had a message before. The
        file is the one that `add_message` would make of them, time by time and in the order of the channels.
        """
        records = [
            _message_records(channel, rows, times) for channel, rows in zip(channels, columns, strict=True)
        ]
        widths = [rows.shape[1] for rows in records]
        data = memoryview(np.hstack(records).reshape(-1))  # type: ignore[arg-type]
        ends = np.add.outer(np.arange(len(times)) * sum(widths), np.cumsum(widths)).reshape(-1)
        begins = ends - np.tile(widths, len(times))
        first = 0
        while first < len(ends):
            free = self._chunk_size - self._size
            last = min(int(np.searchsorted(ends, begins[first] + free)), len(ends) - 1)
            self._add_records(channels, times, begins, first, last)
            self._parts.append(data[int(begins[first]) : int(ends[last])])
            self._size += int(ends[last] - begins[first])
            if self._size >= self._chunk_size:
                self.flush()
            first = last + 1

    def flush(self) -> None:
        """Write the chunk that is being filled, if it holds a message."""
        if not self._entries:
            return
        data = b''.join(self._parts)
        times = [time for entries in self._entries.values() for time in entries[::2]]
        chunk = Chunk(
            compression='zstd',
            data=self._compress(data),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        entries = self._entries
        # Whatever becomes of the write, these messages are no longer pending.
        self._clear_chunk()
        self._write_chunk(chunk, entries)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record behind what is already in the file."""
        record = _packed(Metadata(name=name, metadata=dict(values)))
        offset = self.file.size
        self._append(record)
        self._metadata_indexes.append(MetadataIndex(offset=offset, length=len(record), name=name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment behind what is already in the file."""
        record = _packed(attachment)
        offset = self.file.size
        self._append(record)
        self._attachment_indexes.append(
            AttachmentIndex(
                offset=offset,
                length=len(record),
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )

    def finish(self) -> None:
        """Write summary and footer; the room that was held back is used for it."""
        self.file.release_room()
        self._append(_packed(DataEnd(self._data_crc)))
        self.file.append(self._summary(self.file.size, self.file.kept()))

    def _append(self, data: bytes) -> None:
        self.file.append(data)
        self._data_crc = zlib.crc32(data, self._data_crc)

    def _add_records(
        self,
        channels: Sequence[int],
        times: NDArray[np.int64],
        begins: NDArray[np.int64],
        first: int,
        last: int,
    ) -> None:
        """Index the records `first` .. `last`, which are about to be added to the chunk."""
        count = len(channels)
        shift = self._size - int(begins[first])
        for place in range(first, min(first + count, last + 1)):
            number = channels[place % count]
            entries = self._entries.get(number)
            if entries is None:
                entries = self._open_entries(number)
            found = np.arange(place, last + 1, count)
            entries += np.stack([times[found // count], begins[found] + shift], 1).reshape(-1).tolist()

    def _clear_chunk(self) -> None:
        self._parts: list[bytes | memoryview] = []
        self._entries: dict[int, list[int]] = {}  # channel -> log time, offset, log time, offset, ...
        self._size = 0

    def _open_entries(self, channel: int) -> list[int]:
        record = self._channels[channel - 1]
        if record.schema_id not in self._written_schemas:
            self._put(self._schemas[record.schema_id - 1])
            self._written_schemas.add(record.schema_id)
        if channel not in self._written_channels:
            self._put(record)
            self._written_channels.add(channel)
        return self._entries.setdefault(channel, [])

    def _put(self, record: McapRecord) -> None:
        data = _packed(record)
        self._parts.append(data)
        self._size += len(data)

    def _write_chunk(self, chunk: Chunk, entries: Mapping[int, Sequence[int]]) -> None:
        self._room += _ROOM_PER_CHUNK + 10 * len(entries)
        self.file.keep_room(self._room)
        record = _packed(chunk)
        offset = self.file.size
        packed, index_offsets = [record], {}
        end = offset + len(record)
        for channel, numbers in entries.items():
            index_offsets[channel] = end
            packed.append(_packed_index(channel, numbers))
            end += len(packed[-1])
        self._append(b''.join(packed))
        index = _packed(
            ChunkIndex(
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                chunk_start_offset=offset,
                chunk_length=len(record),
                message_index_offsets=index_offsets,
                message_index_length=end - offset - len(record),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self.file.keep(index)  # a long recording has very many of them
        self._chunk_count += 1
        self._count(chunk, entries)
        self.after_chunk()

    def _count(self, chunk: Chunk, entries: Mapping[int, Sequence[int]]) -> None:
        for channel, numbers in entries.items():
            self.message_counts[channel] = self.message_counts.get(channel, 0) + len(numbers) // 2
        first, last = chunk.message_start_time, chunk.message_end_time
        self.start_time = first if self.start_time is None else min(self.start_time, first)
        self.end_time = last if self.end_time is None else max(self.end_time, last)

    def _summary(self, start: int, chunk_indexes: bytes) -> bytes:
        groups: dict[Opcode, bytes] = {
            Opcode.SCHEMA: _all_packed(self._schemas),
            Opcode.CHANNEL: _all_packed(self._channels),
            Opcode.STATISTICS: _packed(self._statistics()),
            Opcode.CHUNK_INDEX: chunk_indexes,
            Opcode.ATTACHMENT_INDEX: _all_packed(self._attachment_indexes),
            Opcode.METADATA_INDEX: _all_packed(self._metadata_indexes),
        }
        data = bytearray()
        offsets = bytearray()
        for opcode, group in groups.items():
            if group:
                offsets += _packed(SummaryOffset(opcode, start + len(data), len(group)))
                data += group
        offset_start = start + len(data)
        data += offsets
        # The CRC covers the summary and the footer up to the CRC itself.
        footer = struct.pack('<BQQQ', Opcode.FOOTER, 8 + 8 + 4, start, offset_start)
        crc = zlib.crc32(footer, zlib.crc32(data))
        return bytes(data) + _packed(Footer(start, offset_start, crc)) + MCAP0_MAGIC

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts=self.message_counts,
            chunk_count=self._chunk_count,
            message_count=sum(self.message_counts.values()),
            message_end_time=self.end_time or 0,
            message_start_time=self.start_time or 0,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )


def _nothing() -> None:
    """Do nothing: nobody asked to be told."""


def _packed(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _all_packed(records: Sequence[McapRecord]) -> bytes:
    return b''.join(map(_packed, records))


def _message_records(channel: int, rows: NDArray[np.uint8], times: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return one message record for each row of payload, (messages, bytes)."""
    records = np.empty((len(rows), _MESSAGE.size + rows.shape[1]), np.uint8)
    head = _MESSAGE.pack(_MESSAGE_OPCODE, rows.shape[1] + _MESSAGE_HEAD, channel, 0, 0, 0)
    records[:, : _MESSAGE.size] = np.frombuffer(head, np.uint8)
    stamps = times.astype('<u8')[:, None].view(np.uint8)
    records[:, _MESSAGE.size - 16 : _MESSAGE.size - 8] = stamps
    records[:, _MESSAGE.size - 8 : _MESSAGE.size] = stamps
    records[:, _MESSAGE.size :] = rows
    return records


def _packed_index(channel: int, numbers: Sequence[int]) -> bytes:
    size = 8 * len(numbers)
    return _INDEX.pack(Opcode.MESSAGE_INDEX, size + 6, channel, size) + struct.pack(
        f'<{len(numbers)}Q', *numbers
    )
