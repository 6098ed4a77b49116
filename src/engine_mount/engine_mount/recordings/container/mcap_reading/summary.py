"""The end of an MCAP file: the summary, if its checksum holds, and the checksum of what stands before it."""

import mmap
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from io import BytesIO
from typing import TypeVar

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

from engine_mount.recordings.container.mcap_reading.chunks import RECORD, Chunk, indexed_chunk
from engine_mount.recordings.container.unpacking import release

T = TypeVar('T')

_FOOTER_SIZE = 20  # bytes behind opcode and length
_FOOTER_RECORD = RECORD.size + _FOOTER_SIZE
_CRC_SIZE = 4  # bytes
_AT_ONCE = 1 << 22  # bytes, chosen: little of a long file is in memory
_CHUNKS = 256  # chosen: whose heads are in memory at once
_DATA_END = struct.Struct('<BQI')


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
    chunks: list[Chunk] = field(default_factory=list)
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


def data_proof(data: mmap.mmap, end: int) -> Proof:
    """Return what the checksum of the data section says of everything before `end`, where it ends."""
    end_at = end - _DATA_END.size
    if end_at < 0:
        return Proof.ABSENT
    opcode, length, crc = _DATA_END.unpack_from(data, end_at)
    if (opcode, length) != (Opcode.DATA_END, 4):
        return Proof.WRONG
    if not crc:
        return Proof.ABSENT
    return Proof.SOUND if crc == checksum(data, 0, end_at) else Proof.WRONG


def checksum(data: mmap.mmap, begin: int, end: int) -> int:
    """Return the CRC of a part of a file."""
    crc = 0
    for position in range(begin, end, _AT_ONCE):
        crc = zlib.crc32(data[position : min(position + _AT_ONCE, end)], crc)
        release(data)
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
    position = summary.begin
    while position + RECORD.size <= summary.footer:
        opcode, length = RECORD.unpack_from(data, position)
        content = position + RECORD.size
        position = content + length
        if position > summary.footer or not _take(summary, opcode, data, data[content:position]):
            return False
    summary.chunks.sort(key=lambda chunk: chunk.position)
    return True


def _take(summary: Summary, opcode: int, data: mmap.mmap, content: bytes) -> bool:
    """Take a record of the summary; return False where one that is needed is not readable."""
    if opcode == Opcode.CHUNK_INDEX:
        chunk = indexed_chunk(data, content)
        if chunk is not None:
            summary.chunks.append(chunk)
        if len(summary.chunks) % _CHUNKS == 0:
            release(data)
        return chunk is not None
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
