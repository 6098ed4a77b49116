"""Writes the MCAP container: chunks with CRC and message indexes, and a summary at the end.

The records around the messages are those of the `mcap` package. The messages themselves and their
indexes are packed here: `mcap.writer.Writer` makes an object of each, which limits it to a quarter of the
messages per second (measured). A chunk and its indexes reach the file in one write, so every state of the
file ends with a whole record.
"""

import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
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

from mount_recorder.record_file import RecordFile

CHUNK_SIZE = 64 * 1024  # bytes before compression, chosen: what a crash may cost
LONG_CHUNK_SIZE = 4 * CHUNK_SIZE
"""The same where what is written can be made again, chosen: it is read faster, and 4 % smaller (measured)."""
MESSAGE = struct.Struct('<BQHIQQ')  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_OPCODE = int(Opcode.MESSAGE)  # packed faster than the member of the enumeration
_MESSAGE_HEAD = MESSAGE.size - 9  # what the length counts besides the payload
_INDEX = struct.Struct('<BQHI')  # opcode, length, channel, length of the entries
_COMPRESSION_LEVEL = -1
"""Chosen: of noisy numbers little can be packed, and this level does not try (no entropy coding of literals).

Beside level 1 a recording is 1.5 % larger, packed in 85 % and unpacked in 75 % of the time (measured).
"""
_ROOM_PER_CHUNK = 96  # bytes of a chunk index without its channels, rounded up
_ROOM_AT_LEAST = 64 * 1024  # bytes, chosen: metadata of the recording, statistics, footer


class McapWriter:
    """One MCAP file, from its creation to `finish`; every `OSError` leaves whole records behind."""

    def __init__(
        self,
        path: Path,
        library: str,
        chunk_size: int = CHUNK_SIZE,
        open_file: type[RecordFile] = RecordFile,
        size_limit: int = 0,
    ):
        """Write the head of the file and hold back room for its end; `size_limit` in bytes, 0 for none."""
        self.message_counts = Counter[int]()  # by channel, of the chunks that are in the file
        self.full = False
        """Whether one more chunk might make the file larger than its limit."""
        self.finished = False
        """Whether the file has its summary and end."""
        self._chunk_size, self._size_limit = chunk_size, size_limit
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunk_indexes: list[ChunkIndex] = []
        self._metadata_indexes: list[MetadataIndex] = []
        self._declared: set[tuple[type, int]] = set()
        self._data_crc = 0
        self._room = _ROOM_AT_LEAST
        self._begin_chunk()
        self.file = open_file(path)
        try:
            self._append(MCAP0_MAGIC + _packed(Header('ros2', library)))
            self.file.keep_room(self._room)
        except OSError:
            self.file.close()
            path.unlink(missing_ok=True)
            raise

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return sum(map(len, self._entries.values())) // 2

    @property
    def start_time(self) -> int | None:
        """The earliest log time in the file, ns; None without messages."""
        return min((index.message_start_time for index in self._chunk_indexes), default=None)

    @property
    def end_time(self) -> int | None:
        """The latest log time in the file, ns."""
        return max((index.message_end_time for index in self._chunk_indexes), default=None)

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
        """Add one serialised message; times in ns. A full chunk goes to the file."""
        entries = self._entries.get(channel)
        if entries is None:
            self._declare(self._channels[channel - 1])
            entries = self._entries[channel] = []
        length = len(raw)
        entries += (log_time, self._size)
        self._parts += (
            MESSAGE.pack(_MESSAGE_OPCODE, length + _MESSAGE_HEAD, channel, sequence, log_time, publish_time),
            raw,
        )
        self._size += length + MESSAGE.size
        if self._size >= self._chunk_size:
            self.flush()

    def flush(self) -> None:
        """Write the chunk that is being filled, unless it is empty."""
        if not self._entries:
            return
        counts = {channel: len(numbers) // 2 for channel, numbers in self._entries.items()}
        data, index = self._packed_chunk(self.file.size)
        self._begin_chunk()  # whatever becomes of the write, its messages are no longer pending
        self._room += _ROOM_PER_CHUNK + 10 * len(counts)
        self.file.keep_room(self._room)
        self._append(data)
        self._chunk_indexes.append(index)
        self.message_counts.update(counts)
        self.full = 0 < self._size_limit < self.file.size + self._chunk_size + self._room

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record behind what is already in the file."""
        record = _packed(Metadata(name=name, metadata=dict(values)))
        index = MetadataIndex(offset=self.file.size, length=len(record), name=name)
        self._append(record)
        self._metadata_indexes.append(index)

    def finish(self, records: Mapping[str, Mapping[str, str]]) -> None:
        """Write metadata records by name, summary and footer into the room held back, and close the file."""
        try:
            self.file.release_room()
            for name, values in records.items():
                self.add_metadata(name, values)
            self._append(_packed(DataEnd(self._data_crc)))
            self.file.append(self._summary(self.file.size))
            self.finished = True
        finally:
            self.file.close()

    def _append(self, data: bytes) -> None:
        self.file.append(data)
        self._data_crc = zlib.crc32(data, self._data_crc)

    def _begin_chunk(self) -> None:
        self._parts: list[bytes] = []
        self._entries: dict[int, list[int]] = {}  # by channel: log time (ns), offset, log time, offset, ...
        self._size = 0

    def _declare(self, channel: Channel) -> None:
        for record in (self._schemas[channel.schema_id - 1], channel):
            if (known := (type(record), record.id)) not in self._declared:
                self._declared.add(known)
                self._parts.append(_packed(record))
                self._size += len(self._parts[-1])

    def _packed_chunk(self, begin: int) -> tuple[bytes, ChunkIndex]:
        """Return the chunk, which will stand at `begin`, with the indexes of its messages; its own index."""
        data = b''.join(self._parts)
        times = [time for numbers in self._entries.values() for time in numbers[::2]]
        packed = Chunk(
            compression='zstd',
            data=self._compress(data),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        records = _packed(packed)
        length, offsets = len(records), {}
        for channel, numbers in self._entries.items():
            offsets[channel] = begin + len(records)
            size = 8 * len(numbers)
            head = _INDEX.pack(Opcode.MESSAGE_INDEX, size + 6, channel, size)
            records += head + struct.pack(f'<{len(numbers)}Q', *numbers)
        return records, ChunkIndex(
            message_start_time=packed.message_start_time,
            message_end_time=packed.message_end_time,
            chunk_start_offset=begin,
            chunk_length=length,
            message_index_offsets=offsets,
            message_index_length=len(records) - length,
            compression=packed.compression,
            compressed_size=len(packed.data),
            uncompressed_size=packed.uncompressed_size,
        )

    def _summary(self, start: int) -> bytes:
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self.message_counts,
            chunk_count=len(self._chunk_indexes),
            message_count=self.message_counts.total(),
            message_end_time=self.end_time or 0,
            message_start_time=self.start_time or 0,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        groups: dict[Opcode, Sequence[McapRecord]] = {
            Opcode.SCHEMA: self._schemas,
            Opcode.CHANNEL: self._channels,
            Opcode.STATISTICS: [statistics],
            Opcode.CHUNK_INDEX: self._chunk_indexes,
            Opcode.METADATA_INDEX: self._metadata_indexes,
        }
        data = offsets = b''
        for opcode, records in groups.items():
            if group := b''.join(map(_packed, records)):
                offsets += _packed(SummaryOffset(opcode, start + len(data), len(group)))
                data += group
        offset_start = start + len(data)
        data += offsets
        # The CRC covers the summary and the footer up to the CRC itself.
        crc = zlib.crc32(
            struct.pack('<BQQQ', Opcode.FOOTER, 8 + 8 + 4, start, offset_start), zlib.crc32(data)
        )
        return data + _packed(Footer(start, offset_start, crc)) + MCAP0_MAGIC


def _packed(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
