"""Records of an MCAP file: its summary, its chunks, and the messages in these.

A chunk is believed when its checksum holds for the unpacked bytes. The message indexes behind a chunk carry
no checksum: they are used only where the checksum of the whole data section holds.
"""

import mmap
import struct
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, NamedTuple, TypeVar

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import ChunkIndex, Footer
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

T = TypeVar('T')
Offsets = NDArray[np.int64]

HEAD = np.dtype(
    [
        ('opcode', '<u1'),
        ('length', '<i8'),
        ('topic', '<u2'),
        ('sequence', '<u4'),
        ('log_time', '<i8'),
        ('publish_time', '<i8'),
    ]
)
"""The head of a message, as MCAP stores it: the number of its topic, times in ns."""
RECORD = struct.Struct('<BQ')  # opcode, length of what follows
_LEAST_MESSAGE = HEAD.itemsize - RECORD.size  # length of a message record without its payload
_CHUNK = struct.Struct('<BQQQQII')  # record, start, end, unpacked size, CRC, length of the compression's name
_TAIL = struct.Struct('<Q')  # packed size, behind the compression's name
CRC_PLACE = 33
"""Byte of a chunk record at which the checksum of its unpacked messages stands."""
_INDEX = struct.Struct('<BQHI')  # record, channel, length of the entries
_LARGEST_CHUNK = 1 << 28  # bytes unpacked, chosen: sixty times the usual chunk; more is a damaged length
# Length and name of the compression.
_TAG_PLACE = _CHUNK.size - 4
_TAGS = (b'\x04\x00\x00\x00zstd', b'\x03\x00\x00\x00lz4')
FOOTER_LENGTH = 20  # bytes behind opcode and length


class ReadingError(ValueError):
    """A recording, a topic or a column of it cannot be read; the text gives the reason."""


class StoredTopic(NamedTuple):
    """A topic as a file declares it: its type and the definition of that, empty where the file has none.

    `encoding` is that of the messages (`cdr`), `definition_encoding` that of the text (`ros2msg`); `details`
    are `offered_qos_profiles` (YAML), `topic_type_hash` and further notes of the writer.
    """

    name: str
    type: str
    encoding: str
    definition: bytes = b''
    definition_encoding: str = ''
    details: Mapping[str, str] = {}


@dataclass(frozen=True, slots=True)
class StoredMessages:
    """Messages of a file in its order: `heads` (n,) of dtype `HEAD`, bytes `data[begins[i]:ends[i]]`."""

    heads: np.ndarray
    data: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.heads)

    def of(self, topics: Sequence[int]) -> 'StoredMessages':
        """Return the messages of these topics alone."""
        number = self.heads['topic']
        wanted = number == topics[0] if len(topics) == 1 else np.isin(number, topics)
        return self if wanted.all() else self.at(np.flatnonzero(wanted))

    def at(self, places: NDArray[np.int64] | slice) -> 'StoredMessages':
        """Return the messages at these places."""
        return StoredMessages(self.heads[places], self.data, self.begins[places], self.ends[places])

    def payloads(self) -> NDArray[np.uint8] | list[bytes]:
        """Return the bytes as rows if all messages have one length, else one by one."""
        lengths = self.ends - self.begins
        if lengths.size and (lengths == lengths[0]).all():
            return rows_at(self.data, self.begins, int(lengths[0]))
        buffer = self.data.data
        pairs = zip(self.begins.tolist(), self.ends.tolist(), strict=True)
        return [bytes(buffer[begin:end]) for begin, end in pairs]


@dataclass(slots=True)
class Chunk:
    """One chunk of a file; positions in bytes, times in ns.

    `indexes` are {channel: position of its message index, 0 where unknown}, None where no reliable source
    tells which channels have messages in it.
    """

    position: int
    begin: int  # of the packed bytes
    end: int  # of the record and of the packed bytes
    size: int  # bytes when unpacked
    crc: int  # 0 where the writer made none
    compression: str
    start_time: int
    end_time: int
    index_length: int = 0  # bytes of the message indexes behind it, according to a sound summary
    indexes: Mapping[int, int] | None = None

    def holds(self, channels: Collection[int]) -> bool:
        """Return whether there may be messages of one of `channels`."""
        return self.indexes is None or not self.indexes.keys().isdisjoint(channels)


class Summary(NamedTuple):
    """The end of a file; empty unless its checksum holds (`sound`; None where none was written)."""

    sound: bool | None
    begin: int = 0  # of the summary in the file; the data section ends before
    chunks: Sequence[Chunk] = ()
    content: Any = None  # as `mcap` reads it: schemas, channels, statistics

    @property
    def complete(self) -> bool:
        """Whether it is sound and the file need not be searched."""
        known, there = self.content and self.content.statistics, self.content
        if known is None or known.chunk_count != len(self.chunks):
            return False
        if known.channel_count > len(there.channels) or known.schema_count > len(there.schemas):
            return False  # not repeated in the summary
        return bool(known.channel_message_counts.keys() <= there.channels.keys())


def records_in(data: mmap.mmap | bytes, position: int, limit: int) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin of the content and end of each record as far as they are whole before `limit`."""
    while position + RECORD.size <= limit:
        opcode, length = RECORD.unpack_from(data, position)
        begin = position + RECORD.size
        position = begin + length
        if not opcode or position > limit:
            return
        yield opcode, begin, position


def parsed(read: Callable[[ReadDataStream], T], content: bytes) -> T | None:
    """Return the record in `content`, None if it is not readable."""
    try:
        return read(ReadDataStream(BytesIO(content)))
    except (EndOfFile, struct.error, ValueError, MemoryError, OverflowError):
        return None


def read_summary(data: mmap.mmap) -> Summary:
    """Return the summary of a file."""
    place = len(data) - len(MCAP0_MAGIC) - RECORD.size - FOOTER_LENGTH
    if place < len(MCAP0_MAGIC) or RECORD.unpack_from(data, place) != (Opcode.FOOTER, FOOTER_LENGTH):
        return Summary(None)
    footer = Footer.read(ReadDataStream(BytesIO(data[place + RECORD.size : -len(MCAP0_MAGIC)])))
    if not footer.summary_start or not footer.summary_crc:
        return Summary(None)
    if zlib.crc32(data[footer.summary_start : -len(MCAP0_MAGIC) - 4]) != footer.summary_crc:
        return Summary(False)
    try:
        content = SeekingReader(data, record_size_limit=len(data)).get_summary()  # type: ignore[arg-type]
    except (McapError, struct.error, ValueError, OverflowError):
        content = None
    chunks = [_indexed_chunk(data, index) for index in content.chunk_indexes] if content else [None]
    known = [chunk for chunk in chunks if chunk is not None]
    if content is None or len(known) < len(chunks):
        return Summary(False)
    return Summary(True, footer.summary_start, sorted(known, key=lambda chunk: chunk.position), content)


def gaps(chunks: Sequence[Chunk], begin: int, end: int) -> list[tuple[int, int]]:
    """Return the stretches from `begin` to `end` without chunks and their message indexes.

    There is one before each chunk and one behind the last; bytes of the file.
    """
    behind = [begin, *(chunk.end + chunk.index_length for chunk in chunks)]
    return list(zip(behind, [*(chunk.position for chunk in chunks), end], strict=True))


def _indexed_chunk(data: mmap.mmap, index: ChunkIndex) -> Chunk | None:
    """Return the chunk that an index describes, None if that cannot be."""
    position, end = index.chunk_start_offset, index.chunk_start_offset + index.chunk_length
    begin = end - index.compressed_size
    if end > len(data) or begin < position + _CHUNK.size or index.uncompressed_size > _LARGEST_CHUNK:
        return None
    crc = int.from_bytes(data[position + CRC_PLACE : position + CRC_PLACE + 4], 'little')
    return Chunk(
        position,
        begin,
        end,
        index.uncompressed_size,
        crc,
        index.compression,
        index.message_start_time,
        index.message_end_time,
        index.message_index_length,
        index.message_index_offsets if index.message_index_length else None,
    )


def chunk_at(data: mmap.mmap, position: int) -> Chunk | None:
    """Return the chunk whose record begins at `position`, whatever its first byte is, or None."""
    if position < 0 or position + _CHUNK.size + _TAIL.size > len(data):
        return None
    _, length, start, last, size, crc, name_length = _CHUNK.unpack_from(data, position)
    begin, end = position + _CHUNK.size + name_length + _TAIL.size, position + RECORD.size + length
    if name_length > 16 or size > _LARGEST_CHUNK or max(begin, end) > len(data):
        return None
    if begin + _TAIL.unpack_from(data, begin - _TAIL.size)[0] != end:
        return None
    name = data[begin - _TAIL.size - name_length : begin - _TAIL.size].decode(errors='replace')
    return Chunk(position, begin, end, size, crc, name, start, last)


def scattered_chunks(data: mmap.mmap) -> Iterator[Chunk]:
    """Yield every part of a file that looks like a packed chunk with a checksum, wherever it stands."""
    places = set[int]()
    for tag in _TAGS:
        place = data.find(tag, 0)  # without a start, from where the last read ended
        while place >= 0:
            places.add(place - _TAG_PLACE)
            place = data.find(tag, place + 1)
    for place in sorted(places):
        chunk = chunk_at(data, place)
        if chunk is not None and chunk.crc:
            yield chunk


def unpacked(data: mmap.mmap, chunk: Chunk) -> bytes | None:
    """Return the unpacked bytes of a chunk, None if they are damaged or more than its limit."""
    packed, size = data[chunk.begin : chunk.end], chunk.size
    try:
        if chunk.compression == 'zstd':
            if zstandard.frame_content_size(packed) > size:
                return None
            found = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size) if size else b''
        elif chunk.compression == 'lz4':
            found = lz4.frame.LZ4FrameDecompressor().decompress(packed, size + 1)
        else:
            found = b'' if chunk.compression else packed
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError):
        return None
    return found if len(found) == size else None


def scan(content: bytes) -> tuple[Offsets, list[tuple[int, bytes]], bool]:
    """Return where messages begin, the declarations, and whether all bytes are whole records."""
    offsets, declarations, reached = [], [], 0
    for opcode, begin, end in records_in(content, 0, len(content)):
        if opcode == Opcode.MESSAGE:
            if end - begin < _LEAST_MESSAGE:
                break
            offsets.append(begin - RECORD.size)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            declarations.append((opcode, content[begin:end]))
        reached = end
    return np.array(offsets, np.int64), declarations, reached == len(content)


def indexed_offsets(data: mmap.mmap, chunk: Chunk, channels: Collection[int]) -> Offsets | None:
    """Return where messages of `channels` begin in a chunk by its indexes, None without sound ones."""
    if chunk.indexes is None:
        return None
    found = [np.empty(0, np.int64)]
    for channel in chunk.indexes.keys() & channels:
        position = chunk.indexes[channel]
        begin = position + _INDEX.size
        if begin > len(data):
            return None
        opcode, _, number, size = _INDEX.unpack_from(data, position)
        if (opcode, number, size % 16) != (Opcode.MESSAGE_INDEX, channel, 0) or begin + size > len(data):
            return None
        found.append(np.frombuffer(data, '<i8', size // 8, begin)[1::2])
    return np.sort(np.concatenate(found)) if len(found) > 2 else found[-1]


def messages_at(content: bytes | mmap.mmap, offsets: Offsets) -> StoredMessages | None:
    """Return the messages whose records begin at `offsets`, None where one is no whole message."""
    data = np.frombuffer(content, np.uint8)
    if len(offsets) and not 0 <= offsets.min() <= offsets.max() <= len(data) - HEAD.itemsize:
        return None
    heads = rows_at(data, offsets, HEAD.itemsize).view(HEAD)[:, 0] if len(offsets) else np.empty(0, HEAD)
    ends = offsets + RECORD.size + heads['length']
    sound = (heads['opcode'] == Opcode.MESSAGE) & (heads['length'] >= _LEAST_MESSAGE) & (ends <= len(data))
    return StoredMessages(heads, data, offsets + HEAD.itemsize, ends) if sound.all() else None


def rows_at(data: NDArray[np.uint8], begins: NDArray[np.int64], width: int) -> NDArray[np.uint8]:
    """Return `width` bytes from each of `begins` on, which the caller knows to be inside of `data`."""
    if not (width and len(begins)):
        return np.empty((len(begins), width), np.uint8)
    return np.lib.stride_tricks.sliding_window_view(data, width)[begins]
