"""Reads one MCAP file as far as it is proven whole: complete, cut off by a crash, or damaged in places.

Where the summary at the end is sound, it says where the chunks stand, and these are unpacked when a topic
is asked for. Where it is not, the file is walked record by record and searched for chunks, and whatever
their checksums prove is taken. Declarations of topics count more where a checksum covers them.
"""

import mmap
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from mount_bags.container.chunk_index import can_be_there, take_checksums
from mount_bags.container.chunk_table import Places, chunk_table
from mount_bags.container.chunks import (
    MESSAGE_HEAD,
    RECORD,
    Chunk,
    Contents,
    chunk_at,
    contents_of,
    explore,
    messages_at,
    partial_chunk,
    scattered_chunks,
)
from mount_bags.container.message_compression import plain
from mount_bags.container.stored import ACCOUNTS, StorageError, StoredMessages, StoredTopic
from mount_bags.container.summary import (
    Hash,
    Proof,
    covered,
    data_proof,
    hashed,
    parsed,
    parsed_attachment,
    parsed_metadata,
    read_summary,
)
from mount_bags.container.unpacker import Unpacker
from mount_bags.container.whole_files import COMPRESSED_SUFFIXES, FileError, forget, mapped

_KEPT = 1 << 22  # bytes of the file in memory while the chunks are looked at, chosen
_LAST_OPCODE = Opcode.DATA_END
_LENGTHS = {int(Opcode.DATA_END): 4, int(Opcode.FOOTER): 20}
_PRIVATE_OPCODE = 0x80  # and above: of other programs, to be skipped


@dataclass(frozen=True)
class Stretch:
    """A part of the file in which something is lost: bytes from `begin` to `end`."""

    begin: int
    end: int


class McapFile:
    """Topics, metadata and messages of one file; what is wrong with it stands in `warnings`."""

    def __init__(self, path: Path):
        self.path = path
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.records: list[tuple[str, dict[str, str]]] = []
        self.warnings: list[str] = []
        self.lost_beside: list[str] = []  # names of metadata and attachments
        self.chunks = chunk_table(())
        self._damaged: set[int] = set()  # positions of chunks
        self.unexplained: list[Stretch] = []  # what is neither a chunk nor a record that is understood
        self.closed = False  # whether the writer came to the end of its messages
        self.undeclared = 0  # messages whose topic is not known
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        self._data_end = 0  # where the messages end, by the file's own account
        self._footer_found = False
        self._loose: list[int] = []  # messages outside of chunks
        self._records_at: set[int] = set()  # where those of metadata begin
        self._attachments: list[tuple[int, int]] = []  # begin and end of their records
        self._counts: dict[int, int] = {}
        self._times: tuple[int, int] | None = None
        self._data = _opened(path)
        self._summary = read_summary(self._data)
        self._data_proof: Proof | None = None
        self._crc: int | None = None  # of the data section, once it was taken
        if self._summary.proof is not Proof.SOUND or not self._take_summary():
            self._search()
        self.topics = {number: self._topic(channel) for number, channel in self._channels.items()}
        self._note_missing_checksums()

    @property
    def size(self) -> int:
        """The size of the file in bytes."""
        return len(self._data)

    @property
    def proven(self) -> bool:
        """Whether a checksum vouches for what the file says of itself: topics, counts and chunks."""
        return self._summary.proof is Proof.SOUND

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing; chunks count from when they were unpacked."""
        return self.closed and not self.damaged and not self.unexplained

    @property
    def damaged(self) -> bool:
        """Whether messages are known to be lost or may be wrong inside of it, not only at a cut-off end."""
        # What damaged a part that is not understood may have changed a number that nothing protects.
        touched = self._data_proof is Proof.WRONG or bool(self.unexplained)
        doubtful = touched and self._unprotected
        return doubtful or bool(self.undeclared) or bool(self._damaged)

    def message_counts(self) -> dict[int, int]:
        """Return the number of messages by topic: as written where that is proven, else as readable."""
        return dict(self._counts)

    def time_range(self) -> tuple[int, int] | None:
        """Return the earliest and the latest log time (ns), None for a file without messages."""
        return self._times

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        """Yield the messages of `topics` in the order of the file, unpacked where each is packed."""
        self.data_proof()
        wanted = np.array(sorted(topics), np.int64)
        for places in self.passing(self.chunks.holding(topics)):
            for place in places.tolist():
                contents = self.contents(self.chunks[place])
                if contents is not None and len(found := contents.messages.of(wanted)):
                    yield plain(found)
        if self._loose:
            found = messages_at(self._data, np.array(self._loose)).of(wanted)
            if len(found):
                yield plain(found)

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attachments, without those that are damaged."""
        for begin, end in self._attachments:
            attachment = parsed_attachment(self._data[begin + RECORD.size : end])
            if attachment is not None:
                yield attachment
            elif (name := f'attachment at byte {begin}') not in self.lost_beside:
                self.lost_beside.append(name)
                self._warn(f'the {name} is damaged and left out')

    def contents(self, chunk: Chunk) -> Contents | None:
        """Return what is in a chunk; None, with a warning, if it is damaged."""
        if self.is_damaged(chunk):
            return None
        contents = contents_of(self._data, chunk)
        if contents is None:
            self._leave_out(chunk)
        elif not contents.whole:
            self._warn(f'the chunk at byte {chunk.position} ends with what is no record')
        return contents

    @property
    def plain(self) -> bool:
        """Whether a checksum vouches for all of it, and its messages are in chunks that tell their topics."""
        if not self.proven or self._loose or self.data_proof() is not Proof.SOUND:
            return False
        return not self._damaged and self.chunks.plain

    def is_damaged(self, chunk: Chunk) -> bool:
        """Return whether a chunk is known to be damaged; others are taken for sound until they are read."""
        return chunk.position in self._damaged

    def unpacker(self) -> Unpacker:
        """Return what unpacks the chunks of a `plain` file, which need no checksum of their own."""
        return Unpacker(self._data, self.chunks)

    def passing(self, places: Places) -> Iterator[Places]:
        """Yield the numbers of chunks, near ones together; the system may take back what stands before them.

        That is all of the file before, for what stands beside a chunk is read with it.
        """
        positions, first, forgotten = self.chunks.rows['position'][places], 0, 0
        while first < len(places):
            last = int(np.searchsorted(positions, positions[first] + _KEPT, 'right'))
            yield places[first:last]
            end = int(self.chunks.rows['end'][places[last - 1]])
            forget(self._data, forgotten, end)
            first, forgotten = last, end

    def data_proof(self) -> Proof:
        """Read the whole file once and return what its checksum says; with a warning if it is wrong."""
        if self._data_proof is None:
            self._data_proof = data_proof(self._data, self._section_end, self._crc)
            if self._data_proof is Proof.WRONG:
                values = ', and numbers in it may be wrong' if self._unprotected else ''
                self._warn(f'the checksum of its data section is wrong: some byte is damaged{values}')
        return self._data_proof

    def hashed(self, digest: Hash) -> None:
        """Let `digest` take all bytes of the file; `data_proof` then needs no pass of its own."""
        packed = self.path.suffix in COMPRESSED_SUFFIXES  # as a whole: its bytes are others than those read
        end = 0 if packed else covered(self._section_end)
        crc = hashed(self.path, digest, end)
        self._crc = crc if end > 0 else None

    @property
    def _section_end(self) -> int:
        return self._summary.begin if self.proven else self._data_end

    @property
    def _unprotected(self) -> bool:
        """Whether it has messages that no checksum of a chunk covers."""
        return bool(self._loose) or self.chunks.unprotected > 0

    # A file with a sound summary.

    def _take_summary(self) -> bool:
        """Take what the summary tells; False if that is not enough."""
        summary = self._summary
        statistics = summary.statistics
        if statistics is None or statistics.chunk_count != len(summary.chunks):
            return False
        if not can_be_there(summary.chunks, len(self._data)):
            return False
        if statistics.channel_count > len(summary.channels) or statistics.schema_count > len(summary.schemas):
            return False  # not repeated in the summary
        self._channels, self._schemas = dict(summary.channels), dict(summary.schemas)
        if any(channel not in self._channels for channel in statistics.channel_message_counts):
            return False
        self.chunks, summary.chunks = summary.chunks, self.chunks  # once in memory
        self._take_checksums()
        self._counts = dict(statistics.channel_message_counts)
        self._walk_between_chunks()
        self._take_times(statistics)
        self._note_lost_beside()
        self.closed = True
        if self._data[-len(MCAP0_MAGIC) :] != MCAP0_MAGIC:
            self._warn('its last bytes are damaged; all else is read')
        return True

    def _take_checksums(self) -> None:
        data = np.frombuffer(self._data, np.uint8)
        for places in self.passing(np.arange(len(self.chunks))):
            take_checksums(data, self.chunks.rows[places[0] : places[-1] + 1])

    def _take_times(self, statistics: Statistics) -> None:
        """Take the times of the chunks, which are nearer to the messages than the statistics of the file."""
        self._times = self.chunks.times
        if self._loose:
            times = messages_at(self._data, np.array(self._loose)).heads['log_time']
            self._widen(int(times.min()), int(times.max()))
        told = statistics.message_start_time, statistics.message_end_time
        if self._times is not None and told != self._times:
            self._warn('its statistics tell of other times than its chunks; believed are the chunks')

    def _note_lost_beside(self) -> None:
        found = {begin for begin, _ in self._attachments} | self._records_at
        for index in self._summary.beside:
            if index.offset not in found and index.name not in ACCOUNTS:
                self.lost_beside.append(index.name)
                self._warn(f'{index.name}, metadata or attachment at byte {index.offset}, is damaged')

    def _walk_between_chunks(self) -> None:
        begins, limits = self.chunks.gaps(len(MCAP0_MAGIC), self._summary.begin)
        for place in np.flatnonzero(begins < limits):
            self._walk(int(begins[place]), int(limits[place]))
        # A file with chunks has its messages there; a record that says otherwise needs a proof.
        if self._loose and self.chunks and self.data_proof() is not Proof.SOUND:
            self._drop_loose()

    # A file without one.

    def _search(self) -> None:
        self._loose, self._counts, self._times = [], {}, None
        chunks, loose_channels, loose_schemas = self._walk_all()
        self._channels, self._schemas = {}, {}
        for places in self.passing(np.arange(len(chunks))):
            for place in places.tolist():
                self._take_explored(chunks[place])
        self.chunks = chunk_table(chunks)  # with what their messages say of them
        if not self.chunks or (self.whole and self._summary.proof is not Proof.WRONG):
            # Nothing better is known, or there is no reason to doubt.
            self._channels = loose_channels | self._channels
            self._schemas = loose_schemas | self._schemas
        if self._loose and self.chunks and not self.whole:
            self._drop_loose()
        if self._loose:
            self._count(messages_at(self._data, np.array(self._loose)))
        self._forget_undeclared()

    def _walk_all(self) -> tuple[list[Chunk], dict[int, Channel], dict[int, Schema]]:
        """Return the chunks, and the channels and schemas that are declared outside of them."""
        self._channels, self._schemas = {}, {}
        found: list[Chunk] = []
        end = self._walk(len(MCAP0_MAGIC), len(self._data), found)
        cut_off = not (self._footer_found and self._data[end:] == MCAP0_MAGIC)
        if cut_off:
            self.tail = self._tail(end)
            found = self._with_scattered(found)
        self.chunks = chunk_table(found)
        if cut_off:
            self._note_unexplained(found, end)
            self.closed = bool(self._data_end)
            kept = f'read up to byte {end}, {len(found)} whole chunks'
            messages = 'all messages are there' if self.whole else kept
            self._warn(f'ends without its footer, as after a crash: {messages}')
        self.closed = bool(self._data_end)
        if self._summary.proof is Proof.WRONG:
            self._warn('the summary at its end is damaged; its chunks are searched for')
        return found, self._channels, self._schemas

    def _with_scattered(self, walked: list[Chunk]) -> list[Chunk]:
        """Return instead of what the walk found all chunks of the file that their checksums prove."""
        found = {chunk.position: chunk for chunk in scattered_chunks(self._data)}
        found |= {chunk.position: chunk for chunk in walked}
        kept: list[Chunk] = []
        for _, chunk in sorted(found.items()):
            inside = bool(kept) and chunk.position < kept[-1].end
            if not inside and explore(self._data, chunk):
                kept.append(chunk)
        self._loose = [place for place in self._loose if not any(_holds(chunk, place) for chunk in kept)]
        return kept

    def _note_unexplained(self, chunks: Sequence[Chunk], walked: int) -> None:
        position = len(MCAP0_MAGIC)
        stretches = []
        for chunk in chunks:
            stretches.append((position, chunk.position))
            position = chunk.end
        stretches.append((position, len(self._data)))
        for begin, limit in stretches:
            understood = self._understood(begin, limit, walked)
            if understood < limit and not 0 < self._data_end <= understood:
                self.unexplained.append(Stretch(understood, limit))
        for stretch in self.unexplained:
            if stretch.end < len(self._data):
                self._warn(f'bytes {stretch.begin} to {stretch.end} are damaged and left out')

    def _understood(self, position: int, limit: int, walked: int) -> int:
        """Return where from `position` on the last whole record before `limit` ends.

        What stands beside the messages is taken only from `walked` on.
        """
        while position < limit:
            end = self._record_end(position, limit)
            if end is None or self._data[position] == Opcode.CHUNK:
                break
            opcode = self._data[position]
            if opcode == Opcode.DATA_END:
                self._data_end = end
            if position >= walked and opcode in (Opcode.METADATA, Opcode.ATTACHMENT):
                self._take_record(opcode, position, end)
            position = end
        return position

    def _tail(self, position: int) -> Chunk | None:
        """Return the chunk that begins at `position` and ends, by its own account, behind the file's end."""
        if position + RECORD.size > len(self._data):
            return None
        opcode, length = RECORD.unpack_from(self._data, position)
        if opcode != Opcode.CHUNK or position + RECORD.size + length <= len(self._data):
            return None
        return partial_chunk(self._data, position)

    def _take_explored(self, chunk: Chunk) -> None:
        if not explore(self._data, chunk):
            self._leave_out(chunk)
            return
        for opcode, content in chunk.declarations:
            self._declare(opcode, content)
        for channel, count in chunk.counts.items():
            self._counts[channel] = self._counts.get(channel, 0) + count
        if chunk.counts:
            self._widen(chunk.start_time, chunk.end_time)

    def _count(self, messages: StoredMessages) -> None:
        for channel, count in messages.counts().items():
            self._counts[channel] = self._counts.get(channel, 0) + count
        times = messages.heads['log_time']
        self._widen(int(times.min()), int(times.max()))

    def _widen(self, first: int, last: int) -> None:
        if self._times is not None:
            first, last = min(first, self._times[0]), max(last, self._times[1])
        self._times = first, last

    def _forget_undeclared(self) -> None:
        for channel in self._counts.keys() - self._channels.keys():
            count = self._counts.pop(channel)
            self._warn(f'{count} messages of channel {channel} are left out: their topic is not known')
            self.undeclared += count

    # Records outside of chunks.

    def _walk(self, position: int, limit: int, chunks: list[Chunk] | None = None) -> int:
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
                self._take_record(opcode, position, end)
            position = end
            if opcode == Opcode.DATA_END:
                self._data_end = position
            if opcode == Opcode.FOOTER:
                self._footer_found = True
                break
        return position

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

    def _take_record(self, opcode: int, position: int, end: int) -> None:
        if opcode == Opcode.MESSAGE:
            self._loose.append(position)
            return
        if opcode == Opcode.ATTACHMENT:
            self._attachments.append((position, end))
            return
        content = self._data[position + RECORD.size : end]
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._declare(opcode, content)
        elif opcode == Opcode.METADATA:
            metadata = parsed_metadata(content)
            if metadata is None:
                self._warn(f'the metadata at byte {position} is not readable')
            else:
                self.metadata[metadata.name] = dict(metadata.metadata)
                self.records.append((metadata.name, dict(metadata.metadata)))
                self._records_at.add(position)

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

    def _declare(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = parsed(Schema.read, content)
            if schema is not None:
                self._schemas.setdefault(schema.id, schema)
        else:
            channel = parsed(Channel.read, content)
            if channel is not None:
                self._channels.setdefault(channel.id, channel)

    def _leave_out(self, chunk: Chunk) -> None:
        self._damaged.add(chunk.position)
        self._warn(f'the chunk at byte {chunk.position} is damaged and left out')

    def _drop_loose(self) -> None:
        self._warn(f'{len(self._loose)} records outside of its chunks pass for messages; they are left out')
        self._loose = []

    def _note_missing_checksums(self) -> None:
        without = self.chunks.unprotected
        if without:
            what = f'{without} of its {len(self.chunks)} chunks carry'
            self._warn(f'{what} no checksum, as their writer chose: a damaged number in them would go unseen')
        elif self._loose and self.data_proof() is not Proof.SOUND:
            self._warn('its messages are under no sound checksum: a damaged number in them would go unseen')

    def _warn(self, sentence: str) -> None:
        self.warnings.append(f'{self.path.name}: {sentence}')


def _holds(chunk: Chunk, position: int) -> bool:
    return chunk.position <= position < chunk.end


def _is_chunk(data: mmap.mmap, position: int) -> bool:
    """Return whether the record at `position` has the head of a chunk, whatever its first byte says."""
    chunk = partial_chunk(data, position)
    if chunk is None:
        return False
    whole = chunk_at(data, position)
    plain = whole is not None and len(whole.ends) == 1 and whole.end - whole.begin == whole.size > 0
    return chunk.compression in ('zstd', 'lz4') or (plain and not chunk.compression)


def _opened(path: Path) -> mmap.mmap:
    try:
        data = mapped(path)
    except FileError as error:
        raise StorageError(str(error)) from None
    if data[: len(MCAP0_MAGIC)] == MCAP0_MAGIC:
        return data
    known = read_summary(data).proof is Proof.SOUND or next(scattered_chunks(data), None) is not None
    if not known:
        raise StorageError(f'{path} is no MCAP file: its first bytes are not those of one')
    return data
