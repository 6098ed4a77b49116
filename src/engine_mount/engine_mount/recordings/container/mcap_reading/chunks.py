"""Chunks of an MCAP file: where one stands, what is in it, and whether that is proven.

A chunk is believed when its checksum holds for the unpacked bytes and these are records from the first
byte to the last. The message indexes behind a chunk carry no checksum: they are a hint where its records
begin, and taken only if the records found there leave no byte unexplained.
"""

import functools
import mmap
import re
import struct
import zlib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import zstandard
from mcap.opcode import Opcode
from numpy.typing import NDArray

from engine_mount.recordings.container.stored import HEAD, StoredMessages, rows_at
from engine_mount.recordings.container.unpacking import unpacked_lz4, unpacked_zstd, unpacking_limit

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
_FIELDS = {'topic': 'channel', 'sequence': 'sequence', 'log_time': 'log_time', 'publish_time': 'publish_time'}
RECORD = struct.Struct('<BQ')  # opcode, length of what follows
LENGTH_BESIDES_PAYLOAD = MESSAGE_HEAD.itemsize - RECORD.size  # of a message record
_HEAD = struct.Struct('<QQQII')  # start, end, unpacked size, checksum, length of the compression's name
_SIZE = struct.Struct('<Q')
_INDEX = struct.Struct('<HI')  # channel, length of the entries
_INDEX_HEAD = struct.Struct('<QQQQI')  # start, end, position, length of the record, length of the places
_PLACE = struct.Struct('<HQ')  # channel, position of its message index
_INDEX_SIZES = struct.Struct('<QI')  # length of the message indexes, of the compression's name
_TWO_SIZES = struct.Struct('<QQ')  # packed, unpacked
_NEVER = 0xFFFFFFFF  # chosen: of bytes that are 0 the checksum is another
SHORTEST_CHUNK = RECORD.size + _HEAD.size + _SIZE.size
"""Bytes of a chunk record without compression and messages."""
CRC_PLACE = RECORD.size + 3 * _SIZE.size
"""Byte of a chunk record at which the checksum of its unpacked messages stands."""
_TAGS = (b'\x04\x00\x00\x00zstd', b'\x03\x00\x00\x00lz4')
_PLAIN = re.compile(rb'\x06(?=.{4}\x00{4})', re.DOTALL)
LARGEST_CHUNK = 1 << 32
"""Bytes in a chunk; more is a damaged length."""
_MAGICS = {b'\x28\xb5\x2f\xfd': 'zstd', b'\x04\x22\x4d\x18': 'lz4'}


@dataclass(slots=True)
class Chunk:
    """One chunk of a file; positions in bytes, times in ns."""

    position: int
    begin: int  # of the packed bytes
    ends: tuple[int, ...]  # of the packed bytes; two where the lengths in the file contradict each other
    size: int  # bytes when unpacked
    crc: int  # 0 where the writer made none
    compression: str
    start_time: int
    end_time: int
    index_length: int = 0  # bytes of the message indexes behind it, as a sound summary tells them
    indexes: bytes = b''  # channels and positions of their message indexes, as a sound summary tells them
    channels: frozenset[int] | None = None  # those with messages, None where no reliable source tells

    @property
    def end(self) -> int:
        """The end of the record in the file."""
        return self.ends[0]

    def holds(self, channels: Collection[int]) -> bool:
        """Return whether there may be messages of one of `channels`."""
        return self.channels is None or not self.channels.isdisjoint(channels)


@dataclass(frozen=True)
class Contents:
    """The messages in a chunk, and the declarations of schemas and channels among them."""

    messages: StoredMessages
    declarations: tuple[tuple[int, bytes], ...] = ()
    whole: bool = True  # whether the records explain every byte


def indexed_chunk(data: mmap.mmap, content: bytes) -> Chunk | None:
    """Return the chunk of which the content of a chunk index tells, None if that cannot be."""
    try:
        start, last, position, length, size = _INDEX_HEAD.unpack_from(content)
        at = _INDEX_HEAD.size + size
        indexes = content[_INDEX_HEAD.size : at]
        channels = _channels(indexes[:: _PLACE.size], indexes[1 :: _PLACE.size])
        index_length, name_length = _INDEX_SIZES.unpack_from(content, at)
        at += _INDEX_SIZES.size
        name = content[at : at + name_length].decode()
        packed, unpacked = _TWO_SIZES.unpack_from(content, at + name_length)
    except (struct.error, UnicodeDecodeError):
        return None
    end = position + length
    begin = end - packed
    if len(indexes) % _PLACE.size or begin < position + SHORTEST_CHUNK:
        return None
    if end > len(data) or unpacked > LARGEST_CHUNK:
        return None
    crc = int.from_bytes(data[position + CRC_PLACE : position + CRC_PLACE + 4], 'little')
    if not crc and data[position] != Opcode.CHUNK:
        crc = _NEVER  # as in the hole of an outline
    known = channels if index_length else None
    return Chunk(position, begin, (end,), unpacked, crc, name, start, last, index_length, indexes, known)


@functools.lru_cache(maxsize=256)
def _channels(low: bytes, high: bytes) -> frozenset[int]:
    """Return the channels with these bytes: one set for the very many chunks of a long recording."""
    return frozenset(first | second << 8 for first, second in zip(low, high, strict=False))


def chunk_at(data: mmap.mmap, position: int) -> Chunk | None:
    """Return the chunk whose record begins at `position`; None if there is none or its end is missing."""
    if position < 0 or position + SHORTEST_CHUNK > len(data):
        return None
    head = partial_chunk(data, position)
    if head is None:
        return None
    length = RECORD.unpack_from(data, position)[1]
    packed = _SIZE.unpack_from(data, head.begin - _SIZE.size)[0]
    ends = (position + RECORD.size + length, head.begin + packed)
    head.ends = tuple(dict.fromkeys(end for end in ends if head.begin <= end <= len(data)))
    return head if head.ends else None


def partial_chunk(data: mmap.mmap, position: int) -> Chunk | None:
    """Return the chunk that begins at `position` as if the file's end were its own."""
    if position + SHORTEST_CHUNK > len(data):
        return None
    start, last, size, crc, name_length = _HEAD.unpack_from(data, position + RECORD.size)
    begin = position + SHORTEST_CHUNK + name_length
    if name_length > 16 or size > LARGEST_CHUNK or begin > len(data):
        return None
    name = data[begin - _SIZE.size - name_length : begin - _SIZE.size].decode(errors='replace')
    return Chunk(position, begin, (len(data),), size, crc, name, start, last)


def gaps(chunks: Sequence[Chunk], begin: int, end: int) -> list[tuple[int, int]]:
    """Return the stretches from `begin` to `end` without chunks and their message indexes.

    There is one before each chunk and one behind the last; bytes of the file.
    """
    behind = [begin, *(chunk.end + chunk.index_length for chunk in chunks)]
    return list(zip(behind, [*(chunk.position for chunk in chunks), end], strict=True))


def scattered_chunks(data: mmap.mmap) -> Iterator[Chunk]:
    """Yield whatever in a file looks like a chunk with a checksum, wherever it stands."""
    places = {found.start() for found in _PLAIN.finditer(data)}
    for tag in _TAGS:
        place = data.find(tag)
        while place >= 0:
            places.add(place - RECORD.size - _HEAD.size + 4)
            place = data.find(tag, place + 1)
    for place in sorted(places):
        chunk = chunk_at(data, place)
        if chunk is not None and chunk.crc and (chunk.compression or chunk.size in _extents(chunk)):
            yield chunk


def left_out(chunk: Chunk) -> str:
    """Return the sentence on a chunk that is damaged, or tells of more than may be unpacked."""
    limit = unpacking_limit(chunk.end - chunk.begin)
    if chunk.size > limit:
        return (
            f'the chunk at byte {chunk.position} tells of {chunk.size} bytes (limit {limit} for what it '
            'takes in the file) and is left out: write smaller chunks'
        )
    return f'the chunk at byte {chunk.position} is damaged and left out'


def contents_of(data: mmap.mmap, chunk: Chunk) -> Contents | None:
    """Return what is in a chunk, None if it is damaged."""
    for end in chunk.ends:
        content = unpacked(data[chunk.begin : end], chunk)
        if content is not None:
            chunk.ends = (end,)
            contents = _indexed(data, chunk, content) or records_in(content)
            # Without a checksum, bytes that are no records prove damage.
            return contents if chunk.crc or contents.whole else None
    return None


def proven_messages(
    data: mmap.mmap, chunks: Iterable[Chunk], wanted: Collection[int]
) -> StoredMessages | None:
    """Return the messages of `wanted` channels in chunks of a file whose checksum vouches for all bytes.

    Their message indexes are then to be believed. None where a chunk is not as its head and they tell.
    """
    contents, offsets, begin = [], [], 0
    for chunk in chunks:
        content = unpacked(data[chunk.begin : chunk.end], chunk, check=False)
        if content is None:
            return None
        for channel, position in _PLACE.iter_unpack(chunk.indexes):
            if channel in wanted:
                offsets.append(_index_entries(data, position) + begin)
        contents.append(content)
        begin += len(content)
    joined = b''.join(contents)
    found = np.concatenate([np.empty(0, np.int64), *offsets])
    found.sort()
    if found.size and not 0 <= found[0] <= found[-1] <= begin - MESSAGE_HEAD.itemsize:
        return None
    together = np.frombuffer(joined, np.uint8)
    records = _record_heads(together, found)
    messages = _messages(together, found, records)
    sound = (records['opcode'] == Opcode.MESSAGE).all() and (messages.ends <= begin).all()
    return messages if sound and (messages.begins <= messages.ends).all() else None


def records_in(content: bytes) -> Contents:
    """Return the messages and declarations in unpacked bytes as far as these are whole records."""
    offsets, declarations, position = [], [], 0
    while position + RECORD.size <= len(content):
        opcode, length = RECORD.unpack_from(content, position)
        end = position + RECORD.size + length
        if end > len(content) or (opcode == Opcode.MESSAGE and length < LENGTH_BESIDES_PAYLOAD):
            break
        if opcode == Opcode.MESSAGE:
            offsets.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            declarations.append((opcode, content[position + RECORD.size : end]))
        position = end
    messages = messages_at(content, np.array(offsets, np.int64))
    return Contents(messages, tuple(declarations), position == len(content))


def messages_at(content: bytes | mmap.mmap, offsets: Offsets) -> StoredMessages:
    """Return the messages whose records begin at `offsets`."""
    data = np.frombuffer(content, np.uint8)
    return _messages(data, offsets, _record_heads(data, offsets))


def _messages(data: Bytes, offsets: Offsets, records: np.ndarray) -> StoredMessages:
    heads = np.empty(len(records), HEAD)
    for name, in_record in _FIELDS.items():
        heads[name] = records[in_record]
    ends = offsets + RECORD.size + records['length'].astype(np.int64)
    return StoredMessages(heads, data, offsets + MESSAGE_HEAD.itemsize, ends)


def _extents(chunk: Chunk) -> set[int]:
    return {end - chunk.begin for end in chunk.ends}


def unpacked(packed: bytes, chunk: Chunk, *, check: bool = True) -> bytes | None:
    """Return the unpacked bytes if they are the ones that were written, as far as the file can prove it.

    Without `check` only their length is compared.
    """
    kind = chunk.compression
    if chunk.crc and kind not in ('', 'zstd', 'lz4'):
        kind = _MAGICS.get(packed[:4], '')  # a damaged name: the checksum decides
    try:
        content = _unpack(packed, kind, min(chunk.size, unpacking_limit(len(packed))))
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError):
        return None
    sound = zlib.crc32(content) == chunk.crc if check and chunk.crc else len(content) == chunk.size
    return content if sound else None


def _unpack(packed: bytes, kind: str, limit: int) -> bytes:
    if kind == 'zstd':
        return unpacked_zstd(packed, limit)[0]
    if kind == 'lz4':
        return unpacked_lz4(packed, limit)
    if kind:
        raise ValueError(f'unknown compression {kind!r}')
    return packed


def _indexed(data: mmap.mmap, chunk: Chunk, content: bytes) -> Contents | None:
    """Return the messages where the indexes behind the chunk say, None if they do not tell everything."""
    offsets = _index_offsets(data, chunk.end)
    size = len(content)
    if not offsets.size or offsets[0] < 0 or offsets[-1] + MESSAGE_HEAD.itemsize > size:
        return None
    data_of_chunk = np.frombuffer(content, np.uint8)
    records = _record_heads(data_of_chunk, offsets)
    lengths = records['length'].astype(np.int64)
    ends = offsets + RECORD.size + lengths
    begins = np.concatenate([offsets, [size]])
    before = np.concatenate([[0], ends])
    sound = (records['opcode'] == Opcode.MESSAGE).all() and (lengths >= LENGTH_BESIDES_PAYLOAD).all()
    if not sound or (before > begins).any():
        return None
    declarations: list[tuple[int, bytes]] = []
    for place in np.flatnonzero(before != begins):
        between = records_in(content[before[place] : begins[place]])
        if not between.whole or len(between.messages):
            return None
        declarations += between.declarations
    return Contents(_messages(data_of_chunk, offsets, records), tuple(declarations))


def _index_offsets(data: mmap.mmap, position: int) -> Offsets:
    """Return the offsets in all message index records from `position` on, sorted."""
    found = [np.empty(0, np.int64)]
    while position + RECORD.size + _INDEX.size <= len(data):
        opcode, length = RECORD.unpack_from(data, position)
        if opcode != Opcode.MESSAGE_INDEX or not len(entries := _index_entries(data, position)):
            break
        found.append(entries)
        position += RECORD.size + length
    return np.sort(np.concatenate(found))


def _index_entries(data: mmap.mmap, position: int) -> Offsets:
    """Return the offsets in the message index record at `position`, none where it is no sensible one."""
    if position + RECORD.size + _INDEX.size > len(data):
        return np.empty(0, np.int64)
    _, length = RECORD.unpack_from(data, position)
    begin = position + RECORD.size + _INDEX.size
    size = _INDEX.unpack_from(data, begin - _INDEX.size)[1]
    if size != length - _INDEX.size or size % 16 or begin + size > len(data):
        return np.empty(0, np.int64)
    return np.frombuffer(data, '<i8', size // 8, begin)[1::2]


def _record_heads(data: Bytes, offsets: Offsets) -> np.ndarray:
    if not offsets.size:
        return np.empty(0, MESSAGE_HEAD)
    return rows_at(data, offsets, MESSAGE_HEAD.itemsize).view(MESSAGE_HEAD)[:, 0]
