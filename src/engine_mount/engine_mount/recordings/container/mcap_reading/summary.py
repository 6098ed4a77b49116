"""The end of an MCAP file: the summary, if its checksum holds, and the checksum of what stands before it."""

import mmap
import struct
import zlib
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from io import BytesIO
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.container.mcap_reading.chunk_index import indexed_chunks
from engine_mount.recordings.container.mcap_reading.chunk_table import ChunkTable, chunk_table, joined
from engine_mount.recordings.container.mcap_reading.chunks import RECORD
from engine_mount.recordings.container.whole_files import forget

T = TypeVar('T')

_FOOTER_SIZE = 20  # bytes behind opcode and length
_FOOTER_RECORD = RECORD.size + _FOOTER_SIZE
_CRC_SIZE = 4  # bytes
_DATA_END = struct.Struct('<BQI')
_STEP = 1 << 20  # bytes of the file in memory while they are read, chosen
_AT_ONCE = 1 << 18  # bytes, chosen: they stay in the processor's cache from one checksum to the other


class Hash(Protocol):
    """What takes the bytes of a file one after another, as those of `hashlib` do."""

    def update(self, data: memoryview, /) -> None:
        """Take more bytes."""


class Proof(Enum):
    """What a checksum says."""

    SOUND = 'sound'
    WRONG = 'wrong'
    ABSENT = 'absent'  # nothing was written that could prove anything


@dataclass
class Summary:
    """What stands at the end of a file; empty unless `proof` is sound."""

    proof: Proof
    begin: int = 0  # of the summary in the file; the data section ends before
    footer: int = 0
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: ChunkTable = field(default_factory=lambda: chunk_table(()))  # without their checksums
    statistics: Statistics | None = None
    beside: list[MetadataIndex | AttachmentIndex] = field(default_factory=list)


def read_summary(data: mmap.mmap) -> Summary:
    """Return the summary of a file; absent where the file ends without a footer or without a checksum."""
    footer_at = len(data) - len(MCAP0_MAGIC) - _FOOTER_RECORD
    if footer_at < len(MCAP0_MAGIC):
        return Summary(Proof.ABSENT)
    # The opcode is under the checksum too, the length before it as well.
    footer = parsed(Footer.read, data[footer_at + RECORD.size : footer_at + _FOOTER_RECORD])
    if footer is None or not len(MCAP0_MAGIC) <= footer.summary_start < footer_at:
        return Summary(Proof.ABSENT)
    if RECORD.unpack_from(data, footer_at) != (Opcode.FOOTER, _FOOTER_SIZE) or not footer.summary_crc:
        return Summary(Proof.ABSENT)
    if checksum(data, footer.summary_start, footer_at + _FOOTER_RECORD - 4) != footer.summary_crc:
        return Summary(Proof.WRONG)
    summary = Summary(Proof.SOUND, footer.summary_start, footer_at)
    return summary if _fill(summary, data) else Summary(Proof.WRONG)


def data_proof(data: mmap.mmap, end: int, known: int | None = None) -> Proof:
    """Return what the checksum of the data section says of everything before `end`, where it ends.

    `known` is the CRC of what stands before its last record (`covered`), where it was taken already.
    """
    end_at = covered(end)
    if end_at < 0:
        return Proof.ABSENT
    opcode, length, crc = _DATA_END.unpack_from(data, end_at)
    if (opcode, length) != (Opcode.DATA_END, 4):
        return Proof.WRONG
    if not crc:
        return Proof.ABSENT
    return Proof.SOUND if crc == (checksum(data, 0, end_at) if known is None else known) else Proof.WRONG


def covered(end: int) -> int:
    """Return how many bytes of a data section that ends at `end` are under its checksum."""
    return end - _DATA_END.size


def hashed(path: Path, digest: Hash, end: int = 0) -> int:
    """Return the CRC of the bytes before `end` of a file, of which `digest` takes all in the same pass."""
    crc, position, block = 0, 0, memoryview(bytearray(_AT_ONCE))
    with path.open('rb', buffering=0) as stream:
        while count := stream.readinto(block):
            digest.update(block[:count])
            crc = zlib.crc32(block[: min(count, max(end - position, 0))], crc)
            position += count
    return crc


def checksum(data: mmap.mmap, begin: int, end: int) -> int:
    """Return the CRC of a part of a file."""
    crc = 0
    with memoryview(data) as view:
        for position in range(begin, end, _STEP):
            with view[position : min(position + _STEP, end)] as part:
                crc = zlib.crc32(part, crc)
            forget(data, position, position + _STEP)  # a long recording is larger than a worker may be
    return crc


def parsed(read: Callable[[ReadDataStream], T], content: bytes) -> T | None:
    """Return the record in `content`, None if it is not readable."""
    try:
        return read(ReadDataStream(BytesIO(content)))
    except (EndOfFile, struct.error, ValueError, MemoryError, OverflowError):
        return None


def parsed_metadata(content: bytes) -> Metadata | None:
    """Return the metadata record in `content`, None if it is not readable."""
    return parsed(Metadata.read, content)


def parsed_attachment(content: bytes) -> Attachment | None:
    """Return the attachment in `content`, None if it is not readable or its checksum is wrong."""
    crc = int.from_bytes(content[-_CRC_SIZE:], 'little')
    if len(content) < _CRC_SIZE or (crc and zlib.crc32(content[:-_CRC_SIZE]) != crc):
        return None
    return parsed(Attachment.read, content)


def _fill(summary: Summary, data: mmap.mmap) -> bool:
    tables, position = [], summary.begin
    while position + RECORD.size <= summary.footer:
        begin = position
        position, table = _take_part(summary, data, begin)
        if table is None:
            return False
        tables.append(table)
        forget(data, begin, position)
    summary.chunks = joined(tables)
    return True


def _take_part(summary: Summary, data: mmap.mmap, begin: int) -> tuple[int, ChunkTable | None]:
    """Take the records of some `_STEP` bytes; return their end and chunks, None if one is not readable."""
    position, begins, ends = begin, array('q'), array('q')  # of what chunk indexes tell
    while position - begin < _STEP and position + RECORD.size <= summary.footer:
        opcode, length = RECORD.unpack_from(data, position)
        content = position + RECORD.size
        position = content + length
        if position > summary.footer:
            return position, None
        if opcode == Opcode.CHUNK_INDEX:
            begins.append(content)
            ends.append(position)
        elif not _take(summary, opcode, data[content:position]):
            return position, None
    return position, indexed_chunks(np.frombuffer(data, np.uint8), np.array(begins), np.array(ends))


def _take(summary: Summary, opcode: int, content: bytes) -> bool:
    if opcode == Opcode.SCHEMA and (schema := parsed(Schema.read, content)):
        summary.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL and (channel := parsed(Channel.read, content)):
        summary.channels[channel.id] = channel
    elif opcode == Opcode.METADATA_INDEX and (metadata := parsed(MetadataIndex.read, content)):
        summary.beside.append(metadata)
    elif opcode == Opcode.ATTACHMENT_INDEX and (attachment := parsed(AttachmentIndex.read, content)):
        summary.beside.append(attachment)
    elif opcode == Opcode.STATISTICS and (statistics := parsed(Statistics.read, content)):
        summary.statistics = statistics
    else:
        return opcode not in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS)
    return True
