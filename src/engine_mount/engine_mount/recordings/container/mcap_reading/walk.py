"""The records of an MCAP file that stand beside its chunks, one after another as far as they are sensible."""

import mmap
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from engine_mount.recordings.container.mcap_reading.chunks import (
    MESSAGE_HEAD,
    RECORD,
    Chunk,
    chunk_at,
    messages_at,
    partial_chunk,
)
from engine_mount.recordings.container.mcap_reading.summary import parsed, parsed_metadata
from engine_mount.recordings.container.stored import StoredMessages, StoredTopic

_LAST_OPCODE = Opcode.DATA_END
_LENGTHS = {int(Opcode.DATA_END): 4, int(Opcode.FOOTER): 20}
_PRIVATE_OPCODE = 0x80  # and above: of other programs, to be skipped


@dataclass
class Declarations:
    """Schemas and channels of a file by their numbers; the first of a number counts."""

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)

    def add(self, opcode: int, content: bytes) -> None:
        """Take the record of a schema or a channel, if it is readable."""
        if opcode == Opcode.SCHEMA and (schema := parsed(Schema.read, content)):
            self.schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL and (channel := parsed(Channel.read, content)):
            self.channels.setdefault(channel.id, channel)

    def topics(self) -> dict[int, StoredTopic]:
        """Return the topics by the numbers of their channels."""
        return {number: self._topic(channel) for number, channel in self.channels.items()}

    def _topic(self, channel: Channel) -> StoredTopic:
        schema = self.schemas.get(channel.schema_id)
        return StoredTopic(
            name=channel.topic,
            type=schema.name if schema else '',
            encoding=channel.message_encoding,
            definition=schema.data if schema else b'',
            definition_encoding=schema.encoding if schema else '',
            details=channel.metadata,
        )


class Walk:
    """What the records beside the chunks tell, as far as they were walked through."""

    def __init__(self, data: mmap.mmap, warn: Callable[[str], None]):
        self._data, self._warn = data, warn
        self.declared = Declarations()
        self.metadata: dict[str, dict[str, str]] = {}
        self.records: list[tuple[str, dict[str, str]]] = []
        self.attachments: list[tuple[int, int]] = []  # begin and end of their records
        self.loose: list[int] = []  # where messages outside of chunks begin
        self.data_end = 0  # where the messages end, by the file's own account
        self.footer_found = False
        self._metadata_at: set[int] = set()

    def through(self, position: int, limit: int, chunks: list[Chunk] | None = None) -> int:
        """Take the records from `position` on; return where the last whole one before `limit` ends.

        Chunks are added to `chunks`.
        """
        while position < limit:
            end = self._record_end(position, limit)
            if end is None:
                break
            opcode = self._data[position]
            chunk = chunk_at(self._data, position) if opcode == Opcode.CHUNK else None
            if chunk is not None and chunks is not None:
                chunks.append(chunk)
            else:
                self._take(opcode, position, end)
            position = end
            if opcode == Opcode.DATA_END:
                self.data_end = position
            if opcode == Opcode.FOOTER:
                self.footer_found = True
                break
        return position

    def understood(self, position: int, limit: int, walked: int) -> int:
        """Return where from `position` on the last whole record before `limit` ends.

        What stands beside the messages is taken only from `walked` on.
        """
        while position < limit:
            end = self._record_end(position, limit)
            if end is None or self._data[position] == Opcode.CHUNK:
                break
            opcode = self._data[position]
            if opcode == Opcode.DATA_END:
                self.data_end = end
            if position >= walked and opcode in (Opcode.METADATA, Opcode.ATTACHMENT):
                self._take(opcode, position, end)
            position = end
        return position

    @property
    def beside_at(self) -> set[int]:
        """Where the records of metadata and attachments begin."""
        return self._metadata_at | {begin for begin, _ in self.attachments}

    def loose_messages(self) -> StoredMessages:
        """Return the messages outside of chunks."""
        return messages_at(self._data, np.array(self.loose, np.int64))

    def drop_loose(self) -> None:
        """Leave out what passes for messages outside of chunks."""
        self._warn(f'{len(self.loose)} records outside of its chunks pass for messages; they are left out')
        self.loose = []

    def _record_end(self, position: int, limit: int) -> int | None:
        """Return the end of the record at `position`, None if there is no whole and sensible one."""
        if position + RECORD.size > limit:
            return None
        opcode, length = RECORD.unpack_from(self._data, position)
        end = position + RECORD.size + length
        known = 0 < opcode <= _LAST_OPCODE or opcode >= _PRIVATE_OPCODE
        if not known or end > limit or (opcode == Opcode.CHUNK and chunk_at(self._data, position) is None):
            return None
        if opcode == Opcode.MESSAGE and end - position < MESSAGE_HEAD.itemsize:
            return None
        if _LENGTHS.get(opcode, length) != length:
            return None
        if opcode not in (Opcode.CHUNK, Opcode.MESSAGE) and _is_chunk(self._data, position):
            return None  # only its first byte is damaged
        return end

    def _take(self, opcode: int, position: int, end: int) -> None:
        if opcode == Opcode.MESSAGE:
            self.loose.append(position)
        elif opcode == Opcode.ATTACHMENT:
            self.attachments.append((position, end))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self.declared.add(opcode, self._data[position + RECORD.size : end])
        elif opcode == Opcode.METADATA:
            self._take_metadata(position, end)

    def _take_metadata(self, position: int, end: int) -> None:
        metadata = parsed_metadata(self._data[position + RECORD.size : end])
        if metadata is None:
            self._warn(f'the metadata at byte {position} is not readable')
            return
        self.metadata[metadata.name] = dict(metadata.metadata)
        self.records.append((metadata.name, dict(metadata.metadata)))
        self._metadata_at.add(position)


def _is_chunk(data: mmap.mmap, position: int) -> bool:
    """Return whether the record at `position` has the head of a chunk, whatever its first byte says."""
    chunk = partial_chunk(data, position)
    if chunk is None:
        return False
    whole = chunk_at(data, position)
    plain = whole is not None and len(whole.ends) == 1 and whole.end - whole.begin == whole.size > 0
    return chunk.compression in ('zstd', 'lz4') or (plain and not chunk.compression)
