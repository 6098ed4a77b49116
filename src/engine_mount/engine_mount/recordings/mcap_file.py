"""Reads one MCAP file as far as it is proven whole: complete, cut off by a crash, or damaged in places.

Where the summary at the end is sound, it has the places of the chunks, and these are unpacked when a topic
is read. Where it is not, every chunk whose checksum holds is used, wherever it stands. In both cases the
records between the chunks are then read one after another, as far as they are sensible.
"""

import mmap
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.mcap_records import (
    FOOTER_LENGTH,
    RECORD,
    Chunk,
    ReadingError,
    StoredMessages,
    StoredTopic,
    Summary,
    chunk_at,
    gaps,
    indexed_offsets,
    messages_at,
    parsed,
    read_summary,
    records_in,
    scan,
    scattered_chunks,
    unpacked,
)
from mount_recorder.losses import RECORDER_RECORD

ACCOUNTS = ('rosbag2', RECORDER_RECORD)
"""Metadata in which a recording describes itself; a recording made of it has its own."""
_AT_ONCE = 1 << 22  # bytes of chunks that are unpacked together, chosen: more is no faster
_BEGIN = len(MCAP0_MAGIC)
_LENGTHS = {int(Opcode.DATA_END): 4, int(Opcode.FOOTER): FOOTER_LENGTH}
_PRIVATE_OPCODE = 0x80  # and above: of other programs, to be skipped


class McapFile:
    """Topics, metadata and messages of one file; what is wrong with it stands in `warnings`."""

    def __init__(self, path: Path):
        self.path = path
        self.topics: dict[int, StoredTopic] = {}
        self.records: list[tuple[str, dict[str, str]]] = []  # of metadata
        self.warnings: list[str] = []
        self.message_counts = Counter[int]()  # by topic: as written where proven, else as readable
        self.time_range: tuple[int, int] | None = None  # log times in ns, None without messages
        self.chunks: list[Chunk] = []
        self.unexplained: list[tuple[int, int]] = []
        """Bytes, from and to, that are neither a chunk nor a record that is understood."""
        self._damaged: set[int] = set()  # positions of chunks
        self._undeclared = 0  # messages whose topic is not known
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._data_end = 0  # where the messages end, by the file's own account; 0: the end is missing
        self._data = _mapped(path)
        summary = read_summary(self._data)
        self.proven = bool(summary.sound)
        """Whether its own account of its content can be relied upon."""
        if self._data[:_BEGIN] != MCAP0_MAGIC and not summary.sound and not any(scattered_chunks(self._data)):
            raise ReadingError(f'{path} is no MCAP file: its first bytes are not those of one')
        if summary.complete:
            self._use_summary(summary)
        else:
            self._search(summary_damaged=summary.sound is False)
        for chunk in self.chunks:  # without indexes, whether a chunk holds messages shows in its times alone
            if chunk.indexes or (chunk.indexes is None and chunk.end_time > 0):
                times = [*(self.time_range or ()), chunk.start_time, chunk.end_time]
                self.time_range = min(times), max(times)
        for number, channel in self._channels.items():
            schema = self._schemas.get(channel.schema_id)
            self.topics[number] = StoredTopic(
                name=channel.topic,
                type=schema.name if schema else '',
                encoding=channel.message_encoding,
                definition=schema.data if schema else b'',
                definition_encoding=schema.encoding if schema else '',
                details=channel.metadata,
            )
        if self._unprotected:
            what = f'{self._unprotected} of its {len(self.chunks)} chunks carry no checksum'
            self._warn(f'{what}: a damaged number in them would go unseen')

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing; chunks count from when they were unpacked."""
        return bool(self._data_end) and not self.damaged and not self.unexplained

    @property
    def damaged(self) -> bool:
        """Whether messages are known to be lost or may be wrong inside of it, not only at a cut-off end."""
        doubtful = self._unprotected and self.data_proof is False
        return bool(self._undeclared or self._damaged or doubtful)

    @cached_property
    def data_proof(self) -> bool | None:
        """Whether the checksum of all up to the summary holds, None if there is none; a wrong one is told."""
        end = self._data_end - RECORD.size - _LENGTHS[Opcode.DATA_END]
        crc = int.from_bytes(self._data[self._data_end - 4 : self._data_end], 'little')
        if end < 0 or not crc:
            return None
        found = RECORD.unpack_from(self._data, end) == (Opcode.DATA_END, _LENGTHS[Opcode.DATA_END])
        if found and zlib.crc32(memoryview(self._data)[:end]) == crc:
            return True
        values = ', and numbers in it may be wrong' if self._unprotected else ''
        self._warn(f'the checksum of its data section is wrong: some byte is damaged{values}')
        return False

    @property
    def _unprotected(self) -> int:
        return sum(chunk.size > 0 and not chunk.crc for chunk in self.chunks)

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The last record of each name."""
        return dict(self.records)

    def blocks(self, groups: Sequence[Sequence[int]]) -> Iterator[tuple[int, StoredMessages]]:
        """Yield messages of groups of topics with the place of the group, each in the order of the file."""
        trusted = bool(self.data_proof) and self.proven
        topics = {topic for group in groups for topic in group}
        chunks, size = list[Chunk](), 0
        for chunk in [chunk for chunk in self.chunks if chunk.holds(topics)]:
            chunks.append(chunk)
            size += chunk.size
            if size >= _AT_ONCE:
                yield from self._messages_in(chunks, groups, trusted)
                chunks, size = [], 0
        yield from self._messages_in(chunks, groups, trusted)

    def _messages_in(
        self, chunks: list[Chunk], groups: Sequence[Sequence[int]], trusted: bool
    ) -> Iterator[tuple[int, StoredMessages]]:
        """Yield the messages of some chunks at once; `trusted`: by their indexes, no chunk is checked."""
        contents, size = list[bytes](), 0
        offsets = [[np.empty(0, np.int64)] for _ in groups]
        for chunk in chunks:
            content = self._content(chunk, trusted)
            if content is None:
                continue
            indexed = [indexed_offsets(self._data, chunk, group) for group in groups if trusted]
            found = [each for each in indexed if each is not None]
            if len(found) < len(groups):
                found = [scan(content)[0]] * len(groups)
            for places, each in zip(offsets, found, strict=True):
                places.append(each + size)
            contents.append(content)
            size += len(content)
        whole = b''.join(contents)
        for place, group in enumerate(groups):
            messages = messages_at(whole, np.concatenate(offsets[place]))
            if messages is None:  # an index that is wrong although every checksum holds
                yield from ((place, each) for _, each in self._messages_in(chunks, [group], False))
            elif len(wanted := messages.of(group)):
                yield place, wanted

    def _content(self, chunk: Chunk, trusted: bool) -> bytes | None:
        """Return the bytes of a chunk as far as the file can prove them, with a warning if it cannot."""
        if chunk.position in self._damaged:
            return None
        content = unpacked(self._data, chunk)
        # Without a checksum, bytes that are no records prove damage.
        if content is None or not (
            trusted or (zlib.crc32(content) == chunk.crc if chunk.crc else scan(content)[2])
        ):
            self._leave_out(chunk)
            return None
        return content

    def _leave_out(self, chunk: Chunk) -> None:
        self._damaged.add(chunk.position)
        self._warn(f'the chunk at byte {chunk.position} is left out: it is damaged')

    def _use_summary(self, summary: Summary) -> None:
        self.chunks, content = list(summary.chunks), summary.content
        self._schemas, self._channels = content.schemas, content.channels
        for begin, limit in gaps(self.chunks, _BEGIN, summary.begin):
            self._walk(begin, limit)
        self._data_end = summary.begin
        self.message_counts = Counter(content.statistics.channel_message_counts)
        if self._data[-_BEGIN:] != MCAP0_MAGIC:
            self._warn('its last bytes are damaged; all else is read')

    def _search(self, *, summary_damaged: bool) -> None:
        """Use all chunks whose checksum holds, then what stands between them."""
        end = 0
        for chunk in scattered_chunks(self._data):
            if chunk.position >= end and self._use_chunk(chunk):
                end = chunk.end
        reached = 0
        for begin, limit in gaps(self.chunks, _BEGIN, len(self._data)):
            reached = self._walk(begin, limit)
            if reached < limit and not 0 < self._data_end <= reached:
                self.unexplained.append((reached, limit))
                if limit < len(self._data):
                    self._warn(f'bytes {reached} to {limit} are damaged and left out')
        self.chunks.sort(key=lambda chunk: chunk.position)
        if summary_damaged:
            self._warn('the summary at its end is damaged; its chunks are searched for')
        footer = len(self._data) - _BEGIN - FOOTER_LENGTH - RECORD.size
        if self._data[-_BEGIN:] != MCAP0_MAGIC or self._data[max(0, footer)] != Opcode.FOOTER:
            kept = f'read up to byte {reached}, {len(self.chunks) - len(self._damaged)} whole chunks'
            messages = 'all messages are there' if self.whole else kept
            self._warn(f'ends without its footer, as after a crash: {messages}')
        for channel in self.message_counts.keys() - self._channels.keys():
            count = self.message_counts.pop(channel)
            self._warn(f'{count} messages of channel {channel} are left out: their topic is not known')
            self._undeclared += count

    def _use_chunk(self, chunk: Chunk) -> bool:
        """Count the messages in a chunk and read its declarations; False if it is damaged."""
        content = unpacked(self._data, chunk)
        if content is None or (chunk.crc and zlib.crc32(content) != chunk.crc):
            return False
        offsets, declarations, explained = scan(content)
        messages = messages_at(content, offsets)
        if messages is None or not (explained or chunk.crc):
            return False
        for opcode, declaration in declarations:  # the first of a number counts
            if opcode == Opcode.SCHEMA and (schema := parsed(Schema.read, declaration)):
                self._schemas.setdefault(schema.id, schema)
            elif opcode == Opcode.CHANNEL and (channel := parsed(Channel.read, declaration)):
                self._channels.setdefault(channel.id, channel)
        counts = Counter(messages.heads['topic'].tolist())
        self.message_counts.update(counts)
        chunk.indexes = dict.fromkeys(counts, 0)
        if counts:
            times = messages.heads['log_time']
            chunk.start_time, chunk.end_time = int(times.min()), int(times.max())
        self.chunks.append(chunk)
        return True

    def _walk(self, position: int, limit: int) -> int:
        """Use the records from `position` on; return where the last sensible one before `limit` ends."""
        for opcode, begin, end in records_in(self._data, position, limit):
            if opcode == Opcode.MESSAGE and not self.chunks:
                raise ReadingError(
                    f'{self.path} has messages outside of chunks: '
                    f'copy it by rosbags-convert --src {self.path.name} --dst FOLDER and read that'
                )
            known = opcode <= Opcode.DATA_END or opcode >= _PRIVATE_OPCODE
            chunk = chunk_at(self._data, position)
            # A chunk may have a damaged first byte.
            if not known or _LENGTHS.get(opcode, end - begin) != end - begin or opcode == Opcode.MESSAGE:
                break
            if (chunk is None) == (opcode == Opcode.CHUNK):
                break
            if chunk is not None and not self._use_chunk(chunk):
                self.chunks.append(chunk)
                self._leave_out(chunk)
            elif opcode == Opcode.DATA_END:
                self._data_end = end
            elif opcode == Opcode.METADATA:
                metadata = parsed(Metadata.read, self._data[begin:end])
                if metadata is None:
                    self._warn(f'the metadata at byte {position} is not readable')
                else:
                    self.records.append((metadata.name, dict(metadata.metadata)))
            position = end
        return position

    def _warn(self, sentence: str) -> None:
        self.warnings.append(f'{self.path.name}: {sentence}')


def _mapped(path: Path) -> mmap.mmap:
    try:
        with path.open('rb') as file:
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise ReadingError(f'{path} cannot be read: {error.strerror or error}') from None
    except ValueError:
        raise ReadingError(f'{path} is empty') from None
