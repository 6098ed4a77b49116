"""Records of an MCAP file: its summary, its chunks, and the messages in these.

A chunk is believed when its checksum holds for the unpacked bytes and these are records from the first
byte to the last. The message indexes behind a chunk carry no checksum: they are a hint where its records
begin, and taken only if the records found there leave no byte unexplained.
"""

import mmap
import re
import struct
import zlib
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import NamedTuple, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from engine_mount.recordings.stored import HEAD, StoredMessages, rows_at
from engine_mount.recordings.unpacking import unpacked, unpacking_limit

T = TypeVar('T')
Offsets = NDArray[np.int64]

RECORD = struct.Struct('<BQ')  # opcode, length of what follows
_NO_PAYLOAD = HEAD.itemsize - RECORD.size  # length of a message record without its payload
_CHUNK = struct.Struct(
    '<BQQQQII'
)  # record, start, end, unpacked size, checksum, length of compression's name
_TAIL = struct.Struct('<Q')  # packed size, behind the compression's name
CRC_PLACE = 33
"""Byte of a chunk record at which the checksum of its unpacked messages stands."""
_INDEX = struct.Struct('<BQHI')  # record, channel, length of the entries
_NEVER = 0xFFFFFFFF  # chosen: of bytes that are 0 the checksum is another
_LARGEST_CHUNK = 1 << 32  # bytes; more is a damaged length
# Length and name of the compression; of chunks that are not compressed, their first byte and zeros.
_TAG_PLACE = _CHUNK.size - 4
_TAGS = (b'\x04\x00\x00\x00zstd', b'\x03\x00\x00\x00lz4')
_PLAIN = re.compile(rb'\x06(?=.{4}\x00{4}.{28}\x00{4})', re.DOTALL)
_SUMMARY: dict[int, Callable] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.STATISTICS: Statistics.read,
    Opcode.CHUNK_INDEX: ChunkIndex.read,
    Opcode.METADATA_INDEX: MetadataIndex.read,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex.read,
}
_FOOTER_SIZE = 20  # bytes behind opcode and length
_CHUNKS_AT_ONCE = 256  # chosen: whose heads are in memory at once
_AT_ONCE = 1 << 22  # bytes, chosen: little of a long file is in memory


@dataclass(slots=True)
class Chunk:
    """One chunk of a file; positions in bytes, times in ns."""

    position: int
    begin: int  # of the packed bytes
    end: int  # of the record and of the packed bytes
    size: int  # bytes when unpacked
    crc: int  # 0 where the writer made none
    compression: str
    start_time: int
    end_time: int
    index_length: int = 0  # bytes of the message indexes behind it, according to a sound summary
    channels: frozenset[int] | None = None  # those with messages, None where no reliable source has them

    def holds(self, channels: Collection[int]) -> bool:
        """Return whether there may be messages of one of `channels`."""
        return self.channels is None or not self.channels.isdisjoint(channels)

    @property
    def limit(self) -> int:
        """To how many bytes it may unpack."""
        return unpacking_limit(self.end - self.begin)


class Contents(NamedTuple):
    """The messages in unpacked bytes, and the declarations of schemas and channels among them."""

    messages: StoredMessages
    declarations: list[tuple[int, bytes]]
    whole: bool  # whether the records explain every byte


@dataclass
class Summary:
    """The end of a file; empty unless its checksum holds (`sound`; None where none was written)."""

    sound: bool | None
    begin: int = 0  # of the summary in the file; the data section ends before
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    statistics: Statistics | None = None
    beside: list[MetadataIndex | AttachmentIndex] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether it is sound and nothing has to be looked for in the file."""
        known = self.statistics
        if not self.sound or known is None or known.chunk_count != len(self.chunks):
            return False
        if known.channel_count > len(self.channels) or known.schema_count > len(self.schemas):
            return False  # not repeated in the summary
        return known.channel_message_counts.keys() <= self.channels.keys()


def read_summary(data: mmap.mmap) -> Summary:
    """Return the summary of a file."""
    place = len(data) - len(MCAP0_MAGIC) - RECORD.size - _FOOTER_SIZE
    if place < len(MCAP0_MAGIC) or RECORD.unpack_from(data, place) != (Opcode.FOOTER, _FOOTER_SIZE):
        return Summary(None)
    footer = Footer.read(ReadDataStream(BytesIO(data[place + RECORD.size : -len(MCAP0_MAGIC)])))
    if not len(MCAP0_MAGIC) <= footer.summary_start < place or not footer.summary_crc:
        return Summary(None)
    if checksum(data, footer.summary_start, len(data) - len(MCAP0_MAGIC) - 4) != footer.summary_crc:
        return Summary(False)
    found: dict[int, list] = {opcode: [] for opcode in _SUMMARY}
    position = footer.summary_start
    while position + RECORD.size <= place:
        opcode, length = RECORD.unpack_from(data, position)
        begin, position = position + RECORD.size, position + RECORD.size + length
        if opcode not in _SUMMARY:
            continue
        record = parsed(_SUMMARY[opcode], data[begin:position])
        if isinstance(record, ChunkIndex):
            record = indexed_chunk(data, record)
        if record is None or position > place:
            return Summary(False)
        found[opcode].append(record)
        if len(found[Opcode.CHUNK_INDEX]) % _CHUNKS_AT_ONCE == 0:
            data.madvise(mmap.MADV_DONTNEED)
    return Summary(
        True,
        footer.summary_start,
        {schema.id: schema for schema in found[Opcode.SCHEMA]},
        {channel.id: channel for channel in found[Opcode.CHANNEL]},
        sorted(found[Opcode.CHUNK_INDEX], key=lambda chunk: chunk.position),
        next(iter(found[Opcode.STATISTICS]), None),
        found[Opcode.METADATA_INDEX] + found[Opcode.ATTACHMENT_INDEX],
    )


def checksum(data: mmap.mmap, begin: int, end: int) -> int:
    """Return the CRC of a part of a file."""
    crc = 0
    for position in range(begin, end, _AT_ONCE):
        crc = zlib.crc32(data[position : min(position + _AT_ONCE, end)], crc)
        data.madvise(mmap.MADV_DONTNEED)
    return crc


def parsed(read: Callable[[ReadDataStream], T], content: bytes) -> T | None:
    """Return the record in `content`, None if it is not readable."""
    try:
        return read(ReadDataStream(BytesIO(content)))
    except (EndOfFile, struct.error, ValueError, MemoryError, OverflowError):
        return None


# Chunks.


def indexed_chunk(data: mmap.mmap, index: ChunkIndex) -> Chunk | None:
    """Return the chunk that an index describes, None if that cannot be."""
    position, end = index.chunk_start_offset, index.chunk_start_offset + index.chunk_length
    begin = end - index.compressed_size
    if end > len(data) or begin < position + _CHUNK.size or index.uncompressed_size > _LARGEST_CHUNK:
        return None
    crc = int.from_bytes(data[position + CRC_PLACE : position + CRC_PLACE + 4], 'little')
    if not crc and data[position] != Opcode.CHUNK:
        crc = _NEVER  # as in the hole of an outline
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
        frozenset(index.message_index_offsets) if index.message_index_length else None,
    )


def chunk_at(data: mmap.mmap, position: int, *, cut_off: bool = False) -> Chunk | None:
    """Return the chunk whose record begins at `position`, whatever its first byte is; None if there is none.

    With `cut_off` it ends behind the end of the file, which then counts as its own.
    """
    if position < 0 or position + _CHUNK.size + _TAIL.size > len(data):
        return None
    _, length, start, last, size, crc, name_length = _CHUNK.unpack_from(data, position)
    begin, end = position + _CHUNK.size + name_length + _TAIL.size, position + RECORD.size + length
    if name_length > 16 or size > _LARGEST_CHUNK or begin > len(data) or (end > len(data)) != cut_off:
        return None
    if begin + _TAIL.unpack_from(data, begin - _TAIL.size)[0] != end:
        return None
    name = data[begin - _TAIL.size - name_length : begin - _TAIL.size].decode(errors='replace')
    return Chunk(position, begin, min(end, len(data)), size, crc, name, start, last)


def scattered_chunks(data: mmap.mmap) -> Iterator[Chunk]:
    """Yield whatever in a file looks like a chunk with a checksum, wherever it stands."""
    places = {found.start() for found in _PLAIN.finditer(data)}
    for tag in _TAGS:
        place = data.find(tag)
        while place >= 0:
            places.add(place - _TAG_PLACE)
            place = data.find(tag, place + 1)
    for place in sorted(places):
        chunk = chunk_at(data, place)
        if chunk is not None and chunk.crc:
            yield chunk


def gaps(chunks: Sequence[Chunk], begin: int, end: int) -> list[tuple[int, int]]:
    """Return the stretches from `begin` to `end` without chunks and their message indexes.

    There is one before each chunk and one behind the last; bytes of the file.
    """
    behind = [begin, *(chunk.end + chunk.index_length for chunk in chunks)]
    return list(zip(behind, [*(chunk.position for chunk in chunks), end], strict=True))


def verified_content(data: mmap.mmap, chunk: Chunk, *, proven: bool = False) -> bytes | None:
    """Return the unpacked bytes of a chunk as far as the file can prove them, None if it is damaged.

    `proven`: the checksum of the whole file holds, which covers that of the chunk.
    """
    content = unpacked(data[chunk.begin : chunk.end], chunk.compression, min(chunk.size, chunk.limit))
    if content is None or len(content) != chunk.size:
        return None
    if proven:
        return content
    # Without a checksum, bytes that are no records prove damage.
    sound = zlib.crc32(content) == chunk.crc if chunk.crc else _records_in(content)[2]
    return content if sound else None


# Messages.


def contents_of(data: mmap.mmap, chunks: Sequence[tuple[Chunk, bytes]]) -> Contents:
    """Return what is in chunks with their verified bytes."""
    joined = b''.join(content for _, content in chunks)
    offsets, begin = [np.empty(0, np.int64)], 0
    for chunk, content in chunks:
        offsets += [entries + begin for entries in _index_entries(data, chunk.end)]
        begin += len(content)
    found = _indexed_contents(joined, np.sort(np.concatenate(offsets)))
    if found is not None:
        return found
    begins, declarations, whole, begin = [np.empty(0, np.int64)], list[tuple[int, bytes]](), True, 0
    for _, content in chunks:
        places, declared, explained = _records_in(content)
        begins.append(places + begin)
        declarations += declared
        whole &= explained
        begin += len(content)
    return Contents(messages_at(joined, np.concatenate(begins)), declarations, whole)


def messages_at(content: bytes | mmap.mmap, offsets: Offsets) -> StoredMessages:
    """Return the messages whose records begin at `offsets`."""
    data = np.frombuffer(content, np.uint8)
    heads = rows_at(data, offsets, HEAD.itemsize).view(HEAD)[:, 0] if len(offsets) else np.empty(0, HEAD)
    return StoredMessages(heads, data, offsets + HEAD.itemsize, offsets + RECORD.size + heads['length'])


def _records_in(content: bytes) -> tuple[Offsets, list[tuple[int, bytes]], bool]:
    """Return where messages begin, the declarations, and whether all bytes are whole records."""
    offsets, declarations, position = [], [], 0
    while position + RECORD.size <= len(content):
        opcode, length = RECORD.unpack_from(content, position)
        end = position + RECORD.size + length
        if not opcode or end > len(content) or (opcode == Opcode.MESSAGE and length < _NO_PAYLOAD):
            break
        if opcode == Opcode.MESSAGE:
            offsets.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            declarations.append((opcode, content[position + RECORD.size : end]))
        position = end
    return np.array(offsets, np.int64), declarations, position == len(content)


def _indexed_contents(content: bytes, offsets: Offsets) -> Contents | None:
    """Return the messages at `offsets`, None if these and declarations do not explain every byte."""
    if not offsets.size or offsets[0] < 0 or offsets[-1] + HEAD.itemsize > len(content):
        return None
    messages = messages_at(content, offsets)
    begins, ends = np.append(offsets, len(content)), np.append(0, messages.ends)
    heads = messages.heads
    sound = (heads['opcode'] == Opcode.MESSAGE).all() and (heads['length'] >= _NO_PAYLOAD).all()
    if not sound or (ends > begins).any():
        return None
    declarations = []
    for place in np.flatnonzero(ends != begins):
        further, declared, whole = _records_in(content[ends[place] : begins[place]])
        if len(further) or not whole:
            return None
        declarations += declared
    return Contents(messages, declarations, True)


def _index_entries(data: mmap.mmap, position: int) -> Iterator[Offsets]:
    """Yield the offsets in the message index records from `position` on, up to one that is not sensible."""
    while position + _INDEX.size <= len(data):
        opcode, length, _, size = _INDEX.unpack_from(data, position)
        begin, position = position + _INDEX.size, position + RECORD.size + length
        if opcode != Opcode.MESSAGE_INDEX or begin + size != position or size % 16 or position > len(data):
            return
        yield np.frombuffer(data, '<i8', size // 8, begin)[1::2]
