"""Reads one MCAP file as far as it is whole: complete, cut off by a crash, or damaged in places.

The file is walked from its beginning, record by record, so one way of reading serves files with and
without a summary. Chunks are unpacked when a topic is asked for.
"""

import functools
import mmap
import struct
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TypeVar

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

T = TypeVar('T')
Bytes = NDArray[np.uint8]
Offsets = NDArray[np.int64]

# The fixed part of a message record; the payload follows.
MESSAGE_HEAD = np.dtype(
    [
        ('opcode', '<u1'),
        ('length', '<u8'),
        ('channel', '<u2'),
        ('sequence', '<u4'),
        ('log_time', '<u8'),
        ('publish_time', '<u8'),
    ]
)
_HEAD_BYTES = np.arange(MESSAGE_HEAD.itemsize)
PAYLOAD_LENGTH_OFFSET = MESSAGE_HEAD.itemsize - 9  # what the record's length counts besides the payload
_RECORD = struct.Struct('<BQ')
_CHUNK_HEAD = struct.Struct('<QQQII')  # start, end, unpacked size, CRC, length of the compression's name
_LARGEST_CHUNK = 1 << 32  # bytes; more is a damaged length


class McapFileError(ValueError):
    """A file is no MCAP file."""


class Block:
    """Unpacked bytes and where in them the wanted message records begin."""

    def __init__(self, data: Bytes, offsets: Offsets):
        self.data = data
        self.offsets = offsets

    @functools.cached_property
    def heads(self) -> np.ndarray:
        """The fixed parts of the records, a structured array of `MESSAGE_HEAD`."""
        gathered = self.data[self.offsets[:, None] + _HEAD_BYTES]
        return gathered.view(MESSAGE_HEAD)[:, 0]


@dataclass
class _Chunk:
    position: int
    begin: int
    end: int
    unpacked_size: int
    crc: int
    compression: str
    start_time: int
    end_time: int
    indexes: dict[int, Offsets] = field(default_factory=dict)  # channel -> offsets in the unpacked bytes
    walked: bool = False  # whether `indexes` come from the chunk itself
    damaged: bool = False


class McapFile:
    """Channels, metadata and message records of one file; what is wrong with it stands in `warnings`."""

    def __init__(self, path: Path):
        self.path = path
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self.metadata: dict[str, Mapping[str, str]] = {}
        self.warnings: list[str] = []
        self.complete = False
        self._statistics: Statistics | None = None
        self._chunks: list[_Chunk] = []
        self._loose: list[int] = []  # messages outside of chunks
        self._bytes = _map(path)
        self._walk_file()
        self._find_hidden_channels()

    def topic_type(self, channel: int) -> str:
        """Return the type name of a channel, empty where the file tells none."""
        schema = self.schemas.get(self.channels[channel].schema_id)
        return '' if schema is None else schema.name

    def message_counts(self) -> dict[int, int]:
        """Return the number of messages by channel."""
        if self._statistics is not None and self.complete:
            return dict(self._statistics.channel_message_counts)
        counts: dict[int, int] = {}
        for block_counts in map(self._counts, self._chunks):
            for channel, count in block_counts.items():
                counts[channel] = counts.get(channel, 0) + count
        for channel in (self._loose_channel(offset) for offset in self._loose):
            counts[channel] = counts.get(channel, 0) + 1
        return counts

    def time_range(self) -> tuple[int, int] | None:
        """Return the earliest and the latest log time (ns), None for a file without messages."""
        times = [(chunk.start_time, chunk.end_time) for chunk in self._chunks]
        if self._loose:
            logged = Block(self._all(), np.array(self._loose)).heads['log_time']
            times.append((int(logged.min()), int(logged.max())))
        if not times:
            return None
        return min(first for first, _ in times), max(last for _, last in times)

    def blocks(self, channels: Collection[int]) -> Iterator[Block]:
        """Yield the message records of `channels` in the order of the file."""
        loose = [offset for offset in self._loose if self._loose_channel(offset) in channels]
        for chunk in self._chunks:
            # Files have their messages either in chunks or loose; a mixture keeps its order.
            before = [offset for offset in loose if offset < chunk.position]
            if before:
                yield Block(self._all(), np.array(before))
                loose = loose[len(before) :]
            block = self._chunk_block(chunk, channels)
            if block is not None:
                yield block
        if loose:
            yield Block(self._all(), np.array(loose))

    # Walking the file.

    def _walk_file(self) -> None:
        data = self._bytes
        if data[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            raise McapFileError(f'{self.path} is no MCAP file: its first bytes are not those of one')
        position = len(MCAP0_MAGIC)
        while position + _RECORD.size <= len(data):
            opcode, length = _RECORD.unpack_from(data, position)
            begin = position + _RECORD.size
            end = begin + length
            if end > len(data) or opcode == 0:
                break
            self._take_record(opcode, position, begin, end)
            position = end
            if opcode == Opcode.FOOTER:
                self.complete = data[position : position + len(MCAP0_MAGIC)] == MCAP0_MAGIC
                break
        if not self.complete:
            self._note_cut(position)

    def _take_record(self, opcode: int, position: int, begin: int, end: int) -> None:
        if opcode == Opcode.CHUNK:
            self._take_chunk(position, begin, end)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._take_index(begin, end)
        elif opcode == Opcode.MESSAGE and end - position >= MESSAGE_HEAD.itemsize:
            self._loose.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._take_declaration(opcode, self._bytes[begin:end])
        elif opcode == Opcode.STATISTICS:
            self._statistics = self._parsed(Statistics.read, self._bytes[begin:end])
        elif opcode == Opcode.METADATA:
            metadata = self._parsed(Metadata.read, self._bytes[begin:end])
            if metadata is not None:
                self.metadata[metadata.name] = metadata.metadata

    def _take_chunk(self, position: int, begin: int, end: int) -> None:
        if end - begin < _CHUNK_HEAD.size + 8:
            self._warn_of_chunk(position)
            return
        start, last, size, crc, name_length = _CHUNK_HEAD.unpack_from(self._bytes, begin)
        name_begin = begin + _CHUNK_HEAD.size
        data_begin = name_begin + name_length + 8
        if data_begin > end or size > _LARGEST_CHUNK:
            self._warn_of_chunk(position)
            return
        compression = self._bytes[name_begin : name_begin + name_length].decode(errors='replace')
        self._chunks.append(_Chunk(position, data_begin, end, size, crc, compression, start, last))

    def _take_index(self, begin: int, end: int) -> None:
        count = (end - begin - 6) // 16
        if not self._chunks or count <= 0:
            return
        channel = struct.unpack_from('<H', self._bytes, begin)[0]
        entries = np.frombuffer(self._bytes, '<u8', 2 * count, begin + 6).astype(np.int64)
        self._chunks[-1].indexes[channel] = np.sort(entries[1::2])

    def _take_declaration(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema.read, content)
            if schema is not None:
                self.schemas[schema.id] = schema
            return
        channel = self._parsed(Channel.read, content)
        if channel is not None:
            self.channels[channel.id] = channel

    def _parsed(self, read: Callable[[ReadDataStream], T], content: bytes) -> T | None:
        try:
            return read(ReadDataStream(BytesIO(content)))
        except (EndOfFile, struct.error, ValueError) as error:
            self.warnings.append(f'{self.path.name}: a record is not readable ({error or "too short"})')
            return None

    def _note_cut(self, position: int) -> None:
        self.warnings.append(
            f'{self.path.name} ends without its footer, as after a crash: read up to byte {position}, '
            f'{len(self._chunks)} whole chunks'
        )

    def _find_hidden_channels(self) -> None:
        """Look into the chunks where the file has no summary that repeats its channels.

        That also replaces the indexes of a last chunk, of which a crash may have left only some.
        """
        indexed = {channel for chunk in self._chunks for channel in chunk.indexes}
        if self.complete and self.channels and indexed <= self.channels.keys():
            return
        for chunk in self._chunks:
            self._walk_chunk(chunk)

    # Chunks.

    def _chunk_block(self, chunk: _Chunk, channels: Collection[int]) -> Block | None:
        if chunk.damaged or (chunk.indexes and not chunk.indexes.keys() & set(channels)):
            return None
        data = self._unpacked(chunk)
        if data is None:
            return None
        block = _block(chunk, data, channels)
        if chunk.walked or (block is not None and _is_sound(block, channels)):
            return block
        # No index, or one that points astray: look for the messages themselves.
        self._walk_chunk(chunk)
        return _block(chunk, data, channels)

    def _walk_chunk(self, chunk: _Chunk) -> None:
        data = self._unpacked(chunk)
        if data is None or chunk.walked:
            return
        content = data.tobytes()
        found: dict[int, list[int]] = {}
        position = 0
        while position + _RECORD.size <= len(content):
            opcode, length = _RECORD.unpack_from(content, position)
            begin = position + _RECORD.size
            if begin + length > len(content) or (opcode == Opcode.MESSAGE and length < PAYLOAD_LENGTH_OFFSET):
                self._warn_of_chunk(chunk.position)
                break
            if opcode == Opcode.MESSAGE:
                found.setdefault(struct.unpack_from('<H', content, begin)[0], []).append(position)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._take_declaration(opcode, content[begin : begin + length])
            position = begin + length
        chunk.indexes = {channel: np.array(offsets) for channel, offsets in found.items()}
        chunk.walked = True

    def _unpacked(self, chunk: _Chunk) -> Bytes | None:
        if chunk.damaged:
            return None
        packed = self._bytes[chunk.begin : chunk.end]
        try:
            content = _unpack(packed, chunk.compression, chunk.unpacked_size)
        except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError):
            content = None
        if content is None or (chunk.crc and zlib.crc32(content) != chunk.crc):
            chunk.damaged = True
            self._warn_of_chunk(chunk.position)
            return None
        return np.frombuffer(content, np.uint8)

    def _counts(self, chunk: _Chunk) -> dict[int, int]:
        if not chunk.indexes:
            self._walk_chunk(chunk)
        return {channel: offsets.size for channel, offsets in chunk.indexes.items()}

    def _warn_of_chunk(self, position: int) -> None:
        self.warnings.append(f'{self.path.name}: the chunk at byte {position} is damaged and left out')

    # Messages outside of chunks.

    def _all(self) -> Bytes:
        return np.frombuffer(self._bytes, np.uint8)

    def _loose_channel(self, offset: int) -> int:
        return struct.unpack_from('<H', self._bytes, offset + _RECORD.size)[0]


def _map(path: Path) -> mmap.mmap:
    try:
        with path.open('rb') as file:
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise McapFileError(f'{path} cannot be read: {error.strerror}') from None
    except ValueError:
        raise McapFileError(f'{path} is empty') from None


def _block(chunk: _Chunk, data: Bytes, channels: Collection[int]) -> Block | None:
    found = [chunk.indexes[channel] for channel in channels if channel in chunk.indexes]
    if not found:
        return None
    return Block(data, found[0] if len(found) == 1 else np.sort(np.concatenate(found)))


def _is_sound(block: Block, channels: Collection[int]) -> bool:
    if block.offsets[0] < 0 or block.offsets[-1] + MESSAGE_HEAD.itemsize > block.data.size:
        return False
    heads = block.heads
    ends = block.offsets + 9 + heads['length'].astype(np.int64)
    sound = (heads['opcode'] == Opcode.MESSAGE) & (ends <= block.data.size)
    return bool(sound.all() and set(heads['channel'].tolist()) <= set(channels))


def _unpack(packed: bytes, compression: str, size: int) -> bytes:
    if compression == 'zstd':
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    if compression == 'lz4':
        import lz4.frame  # rosbag2 can write it, this project does not

        return lz4.frame.decompress(packed)
    if compression:
        raise ValueError(f'unknown compression {compression!r}')
    return packed
