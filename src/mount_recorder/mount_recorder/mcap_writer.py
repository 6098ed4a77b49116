"""Writes the MCAP container: chunks with CRC and message indexes, and a summary at the end.

The records around the messages are those of the `mcap` package. The messages themselves and their
indexes are packed here: `mcap.writer.Writer` makes an object of each, which limits it to a quarter of the
messages per second (measured).

Each channel belongs to a group, and the messages of a group stand in chunks of their own: a reader that
wants one group alone does not unpack the others. When the chunk of one group is full, those of all groups
go to the file, so that the slow ones lose no more time in a crash than the fast one, and chunks overlap in
time only with those that were written with them. They and their indexes reach the file in one write, so
every state of the file ends with a whole record.
"""

import struct
import zlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import zstandard
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

from mount_recorder.filled_chunk import (
    MESSAGE,
    MESSAGE_HEAD,
    MESSAGE_OPCODE,
    ColumnRecords,
    Entries,
    FilledChunk,
    packed,
    packed_index,
)
from mount_recorder.record_file import RecordFile

CHUNK_SIZE = 64 * 1024  # bytes before compression, chosen: what a crash may cost of each group
LONG_CHUNK_SIZE = 4 * CHUNK_SIZE
"""The same where what is written can be made again, chosen: it is read faster, and 4 % smaller (measured)."""
_COMPRESSION_LEVEL = -1
"""Chosen: of noisy numbers little can be packed, and this level does not try (no entropy coding of literals).

Beside level 1 a recording is 1.5 % larger, packed in 85 % and unpacked in 75 % of the time (measured).
"""
_ROOM_PER_CHUNK = 96  # bytes of a chunk index without its channels, rounded up
_ROOM_AT_LEAST = 64 * 1024  # bytes, chosen: metadata of the recording, statistics, footer


class ChunkedMcap:
    """One MCAP file, written from `start` to `finish`; every `OSError` leaves whole records behind."""

    def __init__(self, file: RecordFile, chunk_size: int = CHUNK_SIZE):
        self.file = file
        self.message_counts: dict[int, int] = {}  # of the chunks that are in the file
        self.start_time: int | None = None  # ns, earliest log time in the file
        self.end_time: int | None = None
        self.after_chunk: Callable[[], None] = _nothing  # called when chunks have reached the file
        self._chunk_size = chunk_size
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunk_count = 0
        self._metadata_indexes: list[MetadataIndex] = []
        self._attachment_indexes: list[AttachmentIndex] = []
        self._groups: dict[int, FilledChunk] = {}
        self._chunk_of: dict[int, FilledChunk] = {}  # by channel
        self._data_crc = 0
        self._room = _ROOM_AT_LEAST

    @property
    def pending(self) -> int:
        """How many messages wait in the chunks that are being filled."""
        return sum(chunk.count for chunk in self._groups.values())

    @property
    def room_needed(self) -> int:
        """How many bytes one more chunk of each group and the end of the file need, from above."""
        return self._chunk_size * len(self._groups) + self._room

    def start(self, profile: str, library: str) -> None:
        """Write the head of the file and hold back room for its end."""
        self._append(MCAP0_MAGIC + packed(Header(profile, library)))
        self.file.keep_room(self._room)

    def add_schema(self, name: str, encoding: str, text: bytes) -> int:
        """Declare a schema and return its id; it is written with the first message that needs it."""
        schema = Schema(id=len(self._schemas) + 1, data=text, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._room += 2 * len(packed(schema))
        return schema.id

    def add_channel(
        self, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str], group: int = 0
    ) -> int:
        """Declare a channel of a group and return its id; it is written with its first message."""
        number = len(self._channels) + 1
        channel = Channel(
            id=number, topic=topic, message_encoding=encoding, metadata=dict(metadata), schema_id=schema_id
        )
        self._channels.append(channel)
        self._chunk_of[number] = self._groups.setdefault(group, FilledChunk())
        self._room += 4 * len(packed(channel))
        return number

    def add_message(
        self, channel: int, raw: bytes, log_time: int, publish_time: int, sequence: int = 0
    ) -> None:
        """Add one serialised message; times in ns. When its chunk is full, all go to the file at once."""
        chunk = self._chunk_of[channel]
        entries = chunk.entries.get(channel)
        if entries is None:
            entries = self._open_entries(channel)
        length = len(raw)
        entries += (log_time, chunk.size)
        chunk.parts += (
            MESSAGE.pack(MESSAGE_OPCODE, length + MESSAGE_HEAD, channel, sequence, log_time, publish_time),
            raw,
        )
        chunk.size += length + MESSAGE.size
        if chunk.size >= self._chunk_size:
            self.flush()

    def add_columns(
        self, channels: Sequence[int], columns: Sequence[NDArray[np.uint8]], times: NDArray[np.int64]
    ) -> None:
        """Add a message of each channel for each of `times` (ns), log time and publish time in one.

        `columns` are their payloads, (times, bytes) for each channel, of which each had a message before. The
        file is the one that `add_message` would make of them, time by time and in the order of the channels.
        """
        parts = self._by_chunk(channels, columns, times)
        first, last = 0, len(channels) * len(times)
        while first < last:
            end = min(last, *(part.filled_by(first, self._chunk_size) for part in parts))
            for part in parts:
                part.add(first, end)
            if any(part.chunk.size >= self._chunk_size for part in parts):
                self.flush()
            first = end

    def flush(self) -> None:
        """Write the chunks that are being filled, of each group that has a message."""
        filled = [chunk for _, chunk in sorted(self._groups.items()) if chunk.entries]
        if filled:
            chunks = [(chunk.record(self._compress), chunk.entries) for chunk in filled]
            # Whatever becomes of the write, these messages are no longer pending.
            for chunk in filled:
                chunk.clear()
            self._write_chunks(chunks)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record behind what is already in the file."""
        record = packed(Metadata(name=name, metadata=dict(values)))
        offset = self.file.size
        self._append(record)
        self._metadata_indexes.append(MetadataIndex(offset=offset, length=len(record), name=name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment behind what is already in the file."""
        record = packed(attachment)
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
        self._append(packed(DataEnd(self._data_crc)))
        self.file.append(self._summary(self.file.size, self.file.kept()))

    def _append(self, data: bytes) -> None:
        self.file.append(data)
        self._data_crc = zlib.crc32(data, self._data_crc)

    def _by_chunk(
        self, channels: Sequence[int], columns: Sequence[NDArray[np.uint8]], times: NDArray[np.int64]
    ) -> list[ColumnRecords]:
        places: dict[FilledChunk, list[int]] = {}
        for place, channel in enumerate(channels):
            places.setdefault(self._chunk_of[channel], []).append(place)
        return [
            ColumnRecords(
                chunk, [channels[i] for i in own], [columns[i] for i in own], own, len(channels), times
            )
            for chunk, own in places.items()
        ]

    def _open_entries(self, channel: int) -> list[int]:
        chunk, record = self._chunk_of[channel], self._channels[channel - 1]
        chunk.declare(self._schemas[record.schema_id - 1])
        chunk.declare(record)
        return chunk.entries.setdefault(channel, [])

    def _write_chunks(self, chunks: Sequence[tuple[Chunk, Entries]]) -> None:
        self._room += sum(_ROOM_PER_CHUNK + 10 * len(entries) for _, entries in chunks)
        self.file.keep_room(self._room)
        records: list[bytes] = []
        indexes: list[ChunkIndex] = []
        end = self.file.size
        for chunk, entries in chunks:
            record = packed(chunk)
            index = _chunk_index(chunk, end, len(record))
            records.append(record)
            end += len(record)
            for channel, numbers in entries.items():
                index.message_index_offsets[channel] = end
                records.append(packed_index(channel, numbers))
                end += len(records[-1])
            index.message_index_length = end - index.chunk_start_offset - index.chunk_length
            indexes.append(index)
        self._append(b''.join(records))
        self.file.keep(_all_packed(indexes))  # a long recording has very many of them
        self._chunk_count += len(chunks)
        for chunk, entries in chunks:
            self._count(chunk, entries)
        self.after_chunk()

    def _count(self, chunk: Chunk, entries: Entries) -> None:
        for channel, numbers in entries.items():
            self.message_counts[channel] = self.message_counts.get(channel, 0) + len(numbers) // 2
        first, last = chunk.message_start_time, chunk.message_end_time
        self.start_time = first if self.start_time is None else min(self.start_time, first)
        self.end_time = last if self.end_time is None else max(self.end_time, last)

    def _summary(self, start: int, chunk_indexes: bytes) -> bytes:
        groups: dict[Opcode, bytes] = {
            Opcode.SCHEMA: _all_packed(self._schemas),
            Opcode.CHANNEL: _all_packed(self._channels),
            Opcode.STATISTICS: packed(self._statistics()),
            Opcode.CHUNK_INDEX: chunk_indexes,
            Opcode.ATTACHMENT_INDEX: _all_packed(self._attachment_indexes),
            Opcode.METADATA_INDEX: _all_packed(self._metadata_indexes),
        }
        data = bytearray()
        offsets = bytearray()
        for opcode, group in groups.items():
            if group:
                offsets += packed(SummaryOffset(opcode, start + len(data), len(group)))
                data += group
        offset_start = start + len(data)
        data += offsets
        # The CRC covers the summary and the footer up to the CRC itself.
        footer = struct.pack('<BQQQ', Opcode.FOOTER, 8 + 8 + 4, start, offset_start)
        crc = zlib.crc32(footer, zlib.crc32(data))
        return bytes(data) + packed(Footer(start, offset_start, crc)) + MCAP0_MAGIC

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


def _chunk_index(chunk: Chunk, position: int, length: int) -> ChunkIndex:
    """Return the index of a chunk whose record of `length` bytes stands at `position`."""
    return ChunkIndex(
        message_start_time=chunk.message_start_time,
        message_end_time=chunk.message_end_time,
        chunk_start_offset=position,
        chunk_length=length,
        message_index_offsets={},
        message_index_length=0,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        uncompressed_size=chunk.uncompressed_size,
    )


def _all_packed(records: Sequence[McapRecord]) -> bytes:
    return b''.join(map(packed, records))
