"""Reads one MCAP file as far as it is proven whole: complete, cut off by a crash, or damaged in places.

Where the summary at the end is sound, it has the places of the chunks, and these are unpacked when a topic
is read. Where it is not, every chunk whose checksum holds is taken, wherever it stands. In both cases the
records between the chunks are then read one after another, as far as they are sensible.
"""

import mmap
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.mcap_records import (
    RECORD,
    Chunk,
    Contents,
    Summary,
    checksum,
    chunk_at,
    contents_of,
    gaps,
    messages_at,
    parsed,
    read_summary,
    scattered_chunks,
    verified_content,
)
from engine_mount.recordings.stored import (
    ACCOUNTS,
    HEAD,
    StorageError,
    StoredFile,
    StoredMessages,
    StoredTopic,
)
from engine_mount.recordings.unpacking import plain

_AT_ONCE = 1 << 20  # bytes of chunks that are unpacked together, chosen
_BEGIN = len(MCAP0_MAGIC)
_LENGTHS = {int(Opcode.DATA_END): 4, int(Opcode.FOOTER): 20}
_PRIVATE_OPCODE = 0x80  # and above: of other programs, to be skipped


class Stretch(NamedTuple):
    """A part of the file in which something is lost: bytes from `begin` to `end`."""

    begin: int
    end: int


class McapFile(StoredFile):
    """Topics, metadata and messages of one file; what is wrong with it stands in `warnings`."""

    time_range: tuple[int, int] | None

    def __init__(self, path: Path):
        super().__init__(path)
        self.chunks: list[Chunk] = []
        self.unexplained: list[Stretch] = []  # neither a chunk nor a record that is understood
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        self._damaged: set[int] = set()  # positions of chunks
        self._undeclared = 0  # messages whose topic is not known
        self._loose: list[int] = []  # where messages outside of chunks begin
        self._beside: dict[int, int] = {}  # begin and end of metadata and attachments
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._data_end = 0  # where the messages end, by the file's own account
        self._data_proof: list[bool | None] = []
        self._data = _mapped(path)
        summary = read_summary(self._data)
        self.proven = bool(summary.sound)
        begins_well = self._data[:_BEGIN] == MCAP0_MAGIC
        if not begins_well and not summary.sound and not any(scattered_chunks(self._data)):
            raise StorageError(f'{path} is no MCAP file: its first bytes are not those of one')
        self._doubted = summary.sound is False
        self._closed = True
        if summary.complete and summary.statistics is not None:
            self._take_summary(summary, summary.statistics)
        else:
            self._search()
        self.topics = {number: self._topic(channel) for number, channel in self._channels.items()}
        self._note_missing_checksums()

    @property
    def size(self) -> int:
        """The size of the file in bytes."""
        return len(self._data)

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing; chunks count from when they were unpacked."""
        return self._closed and not self.damaged and not self.unexplained

    @property
    def damaged(self) -> bool:
        """Whether messages are known to be lost or may be wrong inside of it, not only at a cut-off end."""
        if self._undeclared or self._damaged:
            return True
        # What damaged one part may have changed a number that nothing protects; where other chunks carry a
        # checksum, that of a chunk may be what was lost.
        hurt = self.unexplained or self._checksums_differ or self._doubted or self._data_proof == [False]
        return bool(hurt and self._unprotected and not self.data_proof())

    @property
    def _intact(self) -> bool:
        """Whether every byte up to the end of the messages is understood."""
        return self._closed and not self._damaged and not self.unexplained

    @property
    def _unprotected(self) -> bool:
        """Whether it has messages that no checksum of a chunk covers."""
        return bool(self._loose) or self._unprotected_chunks > 0

    @property
    def _unprotected_chunks(self) -> int:
        return sum(chunk.size > 0 and not chunk.crc for chunk in self.chunks)

    @property
    def _checksums_differ(self) -> bool:
        return self._unprotected_chunks > 0 and any(chunk.crc for chunk in self.chunks)

    def is_damaged(self, chunk: Chunk) -> bool:
        """Return whether a chunk is known to be damaged; others are taken for sound until they are read."""
        return chunk.position in self._damaged

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        proven = bool(self.data_proof()) and self.proven
        for group in _groups([chunk for chunk in self.chunks if chunk.holds(topics)]):
            contents = self._contents(group, proven)
            if len(wanted := contents.messages.of(topics)):
                yield plain(wanted)
            self._data.madvise(mmap.MADV_DONTNEED)
        if len(loose := self._loose_messages().of(topics)):
            yield plain(loose)

    def attachments(self) -> Iterator[Attachment]:
        for begin, end in self._beside.items():
            if self._data[begin] != Opcode.ATTACHMENT:
                continue
            content = self._data[begin + RECORD.size : end]
            crc = int.from_bytes(content[-4:], 'little')
            found = parsed(Attachment.read, content)
            if found is not None and (not crc or zlib.crc32(content[:-4]) == crc):
                yield found
            elif (name := f'attachment at byte {begin}') not in self.lost_beside:
                self.lost_beside.append(name)
                self._warn(f'the {name} is damaged and left out')

    def data_proof(self) -> bool | None:
        """Read the whole file once and return whether its checksum holds, None if it has none.

        A wrong one is a warning.
        """
        if not self._data_proof:
            self._data_proof = [self._checked_data()]
            if self._data_proof == [False]:
                values = ', and numbers in it may be wrong' if self._unprotected else ''
                self._warn(f'the checksum of its data section is wrong: some byte is damaged{values}')
        return self._data_proof[0]

    def _checked_data(self) -> bool | None:
        end = self._data_end - RECORD.size - _LENGTHS[Opcode.DATA_END]
        if end < 0:
            return None
        crc = int.from_bytes(self._data[self._data_end - 4 : self._data_end], 'little')
        if RECORD.unpack_from(self._data, end) != (Opcode.DATA_END, _LENGTHS[Opcode.DATA_END]):
            return False
        return checksum(self._data, 0, end) == crc if crc else None

    def _contents(self, chunks: list[Chunk], proven: bool) -> Contents:
        """Return what is in chunks, with a warning for each that is damaged."""
        found = []
        for chunk in chunks:
            if self.is_damaged(chunk):
                continue
            content = verified_content(self._data, chunk, proven=proven)
            if content is None:
                self._leave_out(chunk)
            else:
                found.append((chunk, content))
        contents = contents_of(self._data, found)
        if not contents.whole:
            self._warn(f'a chunk from byte {chunks[0].position} on ends with what is no record')
        return contents

    def _leave_out(self, chunk: Chunk) -> None:
        self._damaged.add(chunk.position)
        why = 'is damaged and left out'
        if chunk.size > chunk.limit:
            limit = f'limit {chunk.limit} for its bytes in the file'
            why = f'claims {chunk.size} bytes ({limit}) and is left out: write smaller chunks'
        self._warn(f'the chunk at byte {chunk.position} {why}')

    # With a sound summary.

    def _take_summary(self, summary: Summary, statistics: Statistics) -> None:
        self.chunks, self._schemas, self._channels = summary.chunks, summary.schemas, summary.channels
        for begin, limit in gaps(self.chunks, _BEGIN, summary.begin):
            self._walk(begin, limit, [])
        self._data_end = summary.begin
        self._drop_loose()
        self.message_counts = dict(statistics.channel_message_counts)
        # The times of chunks are nearer to the messages than the statistics of the file. Without indexes,
        # whether a chunk holds messages shows in its times alone.
        for chunk in self.chunks:
            if chunk.channels or (chunk.channels is None and chunk.end_time > 0):
                self._extend_time_range(chunk.start_time, chunk.end_time)
        self._extend_time_range(*_times_of(self._loose_messages()))
        stated = statistics.message_start_time, statistics.message_end_time
        if self.time_range not in (None, stated):
            self._warn('its statistics state other times than its chunks; believed are the chunks')
        for index in summary.beside:
            if index.offset not in self._beside and index.name not in ACCOUNTS:
                self.lost_beside.append(index.name)
                self._warn(f'{index.name}, metadata or attachment at byte {index.offset}, is damaged')
        if self._data[-_BEGIN:] != MCAP0_MAGIC:
            self._warn('its last bytes are damaged; all else is read')

    # Without one.

    def _search(self) -> None:
        """Take all chunks whose checksum holds, then what stands between them."""
        end = 0
        for chunk in scattered_chunks(self._data):
            if chunk.position >= end and self._take_chunk(chunk):
                end = chunk.end
        declared = self._schemas, self._channels
        self._schemas, self._channels = {}, {}
        reached, further = 0, list[Chunk]()
        for begin, limit in gaps(self.chunks, _BEGIN, self.size):
            reached = self._walk(begin, limit, further)
            if reached < limit and not 0 < self._data_end <= reached:
                self.unexplained.append(Stretch(reached, limit))
        between = self._schemas, self._channels
        self._schemas, self._channels = declared
        for chunk in further:
            if chunk.crc or not self._take_chunk(chunk):
                self.chunks.append(chunk)
                self._leave_out(chunk)
        self.chunks.sort(key=lambda chunk: chunk.position)
        self._closed = bool(self._data_end)
        if self._closed:  # behind the end of the messages, what passes for one is a damaged declaration
            self._loose = [place for place in self._loose if place < self._data_end]
        self._note_end(reached)
        # Declarations count more where a checksum covers them; the others only where there is no doubt.
        if not self.chunks or (self._intact and not self._doubted):
            self._schemas, self._channels = {**between[0], **declared[0]}, {**between[1], **declared[1]}
        self._drop_loose()
        self._count(self._loose_messages())
        for channel in self.message_counts.keys() - self._channels.keys():
            count = self.message_counts.pop(channel)
            self._warn(f'{count} messages of channel {channel} are left out: their topic is not known')
            self._undeclared += count

    def _take_chunk(self, chunk: Chunk) -> bool:
        """Take topics, counts and times from the messages in a chunk; False if it is damaged."""
        content = verified_content(self._data, chunk)
        if content is None:
            return False
        contents = contents_of(self._data, [(chunk, content)])
        for opcode, declaration in contents.declarations:
            self._declare(opcode, declaration)
        chunk.channels = frozenset(np.unique(contents.messages.heads['topic']).tolist())
        if chunk.channels:
            chunk.start_time, chunk.end_time = _times_of(contents.messages)
        self._count(contents.messages)
        self.chunks.append(chunk)
        return True

    def _note_end(self, reached: int) -> None:
        """Note what is lost, and whether the file ends as its writer would have ended it."""
        for stretch in self.unexplained:
            if stretch.end < self.size:
                self._warn(f'bytes {stretch.begin} to {stretch.end} are damaged and left out')
        if self._doubted:
            self._warn('the summary at its end is damaged; its chunks are searched for')
        footer = _LENGTHS[Opcode.FOOTER] + RECORD.size
        whole_end = self._data[reached:] == MCAP0_MAGIC and self._data[reached - footer] == Opcode.FOOTER
        if whole_end:
            return
        if reached + RECORD.size < self.size and self._data[reached] == Opcode.CHUNK:
            self.tail = chunk_at(self._data, reached, cut_off=True)
        kept = f'read up to byte {reached}, {len(self.chunks) - len(self._damaged)} whole chunks'
        messages = 'all messages are there' if self._intact else kept
        self._warn(f'ends without its footer, as after a crash: {messages}')

    # In both cases.

    def _walk(self, position: int, limit: int, chunks: list[Chunk]) -> int:
        """Take the records from `position` on; return where the last whole one before `limit` ends.

        Chunks are added to `chunks`.
        """
        while position + RECORD.size <= limit:
            opcode, length = RECORD.unpack_from(self._data, position)
            end = position + RECORD.size + length
            known = 0 < opcode <= Opcode.DATA_END or opcode >= _PRIVATE_OPCODE
            if not known or end > limit or _LENGTHS.get(opcode, length) != length:
                break
            chunk = chunk_at(self._data, position)
            if (chunk is None) == (opcode == Opcode.CHUNK):
                break  # no chunk, or one of which the first byte is damaged
            if opcode == Opcode.MESSAGE and end - position < HEAD.itemsize:
                break
            chunks += [chunk] if chunk else []
            self._take_record(opcode, position, end)
            position = end
        return position

    def _take_record(self, opcode: int, position: int, end: int) -> None:
        if opcode == Opcode.MESSAGE:
            self._loose.append(position)
        elif opcode == Opcode.DATA_END:
            self._data_end = end
        elif opcode == Opcode.METADATA:
            metadata = parsed(Metadata.read, self._data[position + RECORD.size : end])
            if metadata is None:
                self._warn(f'the metadata at byte {position} is not readable')
                return
            self.records.append((metadata.name, dict(metadata.metadata)))
            self._beside[position] = end
        elif opcode == Opcode.ATTACHMENT:
            self._beside[position] = end
        else:
            self._declare(opcode, self._data[position + RECORD.size : end])

    def _declare(self, opcode: int, content: bytes) -> None:
        """Take a schema or a channel; the first of a number counts."""
        if opcode == Opcode.SCHEMA and (schema := parsed(Schema.read, content)):
            self._schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL and (channel := parsed(Channel.read, content)):
            self._channels.setdefault(channel.id, channel)

    def _loose_messages(self) -> StoredMessages:
        return messages_at(self._data, np.array(self._loose, np.int64))

    def _drop_loose(self) -> None:
        """Leave out messages outside of chunks unless a checksum proves them or there are no chunks."""
        if self._loose and self.chunks and not (self._intact and self.data_proof()):
            self._warn(
                f'{len(self._loose)} records outside of its chunks pass for messages; they are left out'
            )
            self._loose = []

    def _count(self, messages: StoredMessages) -> None:
        for channel, count in zip(*np.unique(messages.heads['topic'], return_counts=True), strict=True):
            self.message_counts[int(channel)] = self.message_counts.get(int(channel), 0) + int(count)
        self._extend_time_range(*_times_of(messages))

    def _extend_time_range(self, *times: int) -> None:
        known = [*(self.time_range or ()), *times]
        self.time_range = (min(known), max(known)) if known else None

    def _topic(self, channel: Channel) -> StoredTopic:
        schema = self._schemas.get(channel.schema_id)
        return StoredTopic(
            name=channel.topic,
            type=schema.name if schema else '',
            encoding=channel.message_encoding,
            definition=schema.data if schema else b'',
            definition_encoding=schema.encoding if schema else '',
            details=channel.metadata,
        )

    def _note_missing_checksums(self) -> None:
        without = self._unprotected_chunks
        if without:
            what = f'{without} of its {len(self.chunks)} chunks carry no checksum'
            why = 'while others do' if self._checksums_differ else 'as their writer chose'
            self._warn(f'{what}, {why}: a damaged number in them would go unseen')
        elif self._loose and not self.data_proof():
            self._warn('its messages are under no sound checksum: a damaged number in them would go unseen')

    def _warn(self, sentence: str) -> None:
        self.warnings.append(f'{self.path.name}: {sentence}')


def _mapped(path: Path) -> mmap.mmap:
    try:
        with path.open('rb') as file:
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise StorageError(f'{path} cannot be read: {error.strerror or error}') from None
    except ValueError:
        raise StorageError(f'{path} is empty') from None


def _groups(chunks: list[Chunk]) -> Iterator[list[Chunk]]:
    """Yield chunks in their order, those together that unpack into some `_AT_ONCE` bytes."""
    group, size = list[Chunk](), 0
    for chunk in chunks:
        group.append(chunk)
        size += min(chunk.size, chunk.limit)
        if size >= _AT_ONCE:
            yield group
            group, size = [], 0
    if group:
        yield group


def _times_of(messages: StoredMessages) -> tuple[int, ...]:
    """Return the first and the last log time in ns, nothing without messages."""
    times = messages.heads['log_time']
    return (int(times.min()), int(times.max())) if len(times) else ()
