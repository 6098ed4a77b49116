"""Reads one MCAP file as far as it is proven whole: complete, cut off by a crash, or damaged in places.

Where the summary at the end is sound, it says where the chunks stand, and these are unpacked when a topic
is read. Where it is not, the file is searched (`Salvage`).
"""

import mmap
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
from mcap.records import Attachment, Statistics
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.container.mcap_reading.chunks import (
    RECORD,
    Chunk,
    Contents,
    contents_of,
    gaps,
    left_out,
    proven_messages,
    scattered_chunks,
)
from engine_mount.recordings.container.mcap_reading.salvage import Salvage, Stretch
from engine_mount.recordings.container.mcap_reading.summary import (
    Proof,
    Summary,
    data_proof,
    parsed_attachment,
    read_summary,
)
from engine_mount.recordings.container.mcap_reading.walk import Declarations, Walk
from engine_mount.recordings.container.stored import (
    ACCOUNTS,
    StorageError,
    StoredFile,
    StoredMessages,
    united,
)
from engine_mount.recordings.container.unpacking import mapped, plain, release, unpacking_limit

_AT_ONCE = 1 << 20  # bytes of chunks that are unpacked together, chosen


class McapFile(StoredFile):
    """Topics, metadata and messages of one file; what is wrong with it stands in `warnings`."""

    _times: tuple[int, int] | None

    def __init__(self, path: Path):
        super().__init__(path)
        self.unexplained: list[Stretch] = []  # what is neither a chunk nor a record that is understood
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        self._damaged: set[int] = set()  # positions of chunks
        self._undeclared = 0  # messages whose topic is not known
        self._data = _opened(path)
        self._data_proof: Proof | None = None
        summary = read_summary(self._data)
        self._summary_proof, self._summary_begin = summary.proof, summary.begin
        if _is_enough(summary):
            self._take_summary(summary)
        else:
            self._take_found()
        self.metadata, self.records = self._walk.metadata, self._walk.records
        self._unprotected_chunks = sum(chunk.size > 0 and not chunk.crc for chunk in self.chunks)
        self._checksums_differ = self._unprotected_chunks > 0 and any(chunk.crc for chunk in self.chunks)
        self._note_missing_checksums()

    @property
    def size(self) -> int:
        """The size of the file in bytes."""
        return len(self._data)

    @property
    def proven(self) -> bool:
        """Whether a checksum vouches for what the file says of itself: topics, counts and chunks."""
        return self._summary_proof is Proof.SOUND

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing; chunks count from when they were unpacked."""
        return self._closed and not self.damaged and not self.unexplained

    @property
    def damaged(self) -> bool:
        """Whether messages are known to be lost or may be wrong inside of it, not only at a cut-off end."""
        return self._doubtful or bool(self._undeclared) or bool(self._damaged)

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        wanted = np.array(sorted(topics), np.int64)
        chunks = [chunk for chunk in self.chunks if chunk.holds(topics)]
        proven = self.data_proof() is Proof.SOUND and self.proven and not self._damaged
        for group in _groups(chunks):
            found = None
            if proven and all(chunk.channels is not None for chunk in group):
                found = proven_messages(self._data, group, topics)
            for messages in [found] if found is not None else self._messages_in(group):
                wanted_ones = messages.of(wanted)
                if len(wanted_ones):
                    yield plain(wanted_ones)
            release(self._data)
        loose = self._walk.loose_messages().of(wanted)
        if len(loose):
            yield plain(loose)

    def _messages_in(self, chunks: list[Chunk]) -> Iterator[StoredMessages]:
        """Yield the messages of chunks, each proven by itself."""
        for chunk in chunks:
            contents = self.contents(chunk)
            if contents is not None:
                yield contents.messages

    def attachments(self) -> Iterator[Attachment]:
        for begin, end in self._walk.attachments:
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
            self._damaged.add(chunk.position)
            self._warn(left_out(chunk))
        elif not contents.whole:
            self._warn(f'the chunk at byte {chunk.position} ends with what is no record')
        return contents

    def is_damaged(self, chunk: Chunk) -> bool:
        """Return whether a chunk is known to be damaged; others are taken for sound until they are read."""
        return chunk.position in self._damaged

    def data_proof(self) -> Proof:
        """Read the whole file once and return what its checksum says; with a warning if it is wrong."""
        if self._data_proof is None:
            end = self._summary_begin if self.proven else self._walk.data_end
            self._data_proof = data_proof(self._data, end)
            if self._data_proof is Proof.WRONG:
                values = ', and numbers in it may be wrong' if self._unprotected else ''
                self._warn(f'the checksum of its data section is wrong: some byte is damaged{values}')
        return self._data_proof

    @property
    def _doubtful(self) -> bool:
        """Whether something is known to be damaged, and numbers that nothing protects may be, too."""
        # What damaged one part may have changed a number that nothing protects; where other chunks carry a
        # checksum, that of a chunk may be what was lost.
        hurt = bool(self.unexplained) or self._checksums_differ
        hurt = hurt or Proof.WRONG in (self._summary_proof, self._data_proof)
        return hurt and self._unprotected and self.data_proof() is not Proof.SOUND

    @property
    def _unprotected(self) -> bool:
        """Whether it has messages that no checksum of a chunk covers."""
        return bool(self._walk.loose) or self._unprotected_chunks > 0

    def _take_summary(self, summary: Summary) -> None:
        """Take what a summary tells that is sound and enough."""
        self.chunks = summary.chunks
        self._walk = Walk(self._data, self._warn)
        self._walk.declared = Declarations(summary.channels, summary.schemas)
        self.topics = self._walk.declared.topics()
        for begin, limit in gaps(self.chunks, len(MCAP0_MAGIC), summary.begin):
            if begin < limit:
                self._walk.through(begin, limit)
        # A file with chunks has its messages there; a record that says otherwise needs a proof.
        if self._walk.loose and self.chunks and self.data_proof() is not Proof.SOUND:
            self._walk.drop_loose()
        self._closed = True
        if (statistics := summary.statistics) is not None:
            self._counts = dict(statistics.channel_message_counts)
            self._take_times(statistics)
        for index in summary.beside:
            if index.offset not in self._walk.beside_at and index.name not in ACCOUNTS:
                self.lost_beside.append(index.name)
                self._warn(f'{index.name}, metadata or attachment at byte {index.offset}, is damaged')
        if self._data[-len(MCAP0_MAGIC) :] != MCAP0_MAGIC:
            self._warn('its last bytes are damaged; all else is read')

    def _take_times(self, statistics: Statistics) -> None:
        """Take the times of the chunks, which are nearer to the messages than the statistics of the file."""
        for chunk in self.chunks:
            # Without indexes, whether a chunk holds messages shows in its times alone.
            if chunk.channels or (chunk.channels is None and chunk.end_time > 0):
                self._times = united(self._times, (chunk.start_time, chunk.end_time))
        if self._walk.loose:
            self._times = united(self._times, self._walk.loose_messages().time_range())
        stated = statistics.message_start_time, statistics.message_end_time
        if self._times is not None and stated != self._times:
            self._warn('its statistics tell of other times than its chunks; believed are the chunks')

    def _take_found(self) -> None:
        """Take what a search finds."""
        damaged = self._summary_proof is Proof.WRONG
        found = Salvage(self._data, self._warn, damaged_summary=damaged)
        self.chunks, self.tail, self.unexplained = found.chunks, found.tail, found.unexplained
        self.topics, self._walk = found.declared.topics(), found.walk
        self._counts = found.counts
        self._times = found.times
        self._closed, self._damaged, self._undeclared = found.closed, found.damaged, found.undeclared

    def _note_missing_checksums(self) -> None:
        without = self._unprotected_chunks
        if without:
            what = f'{without} of its {len(self.chunks)} chunks carry no checksum'
            why = 'while others do' if self._checksums_differ else 'as their writer chose'
            self._warn(f'{what}, {why}: a damaged number in them would go unseen')
        elif self._walk.loose and self.data_proof() is not Proof.SOUND:
            self._warn('its messages are under no sound checksum: a damaged number in them would go unseen')

    def _warn(self, sentence: str) -> None:
        self.warnings.append(f'{self.path.name}: {sentence}')


def _is_enough(summary: Summary) -> bool:
    """Return whether a summary is sound and tells all that is needed of it."""
    statistics = summary.statistics
    if summary.proof is not Proof.SOUND or statistics is None:
        return False
    if statistics.chunk_count != len(summary.chunks):
        return False
    if statistics.channel_count > len(summary.channels) or statistics.schema_count > len(summary.schemas):
        return False  # not repeated in the summary
    return all(channel in summary.channels for channel in statistics.channel_message_counts)


def _opened(path: Path) -> mmap.mmap:
    data = mapped(path)
    if data[: len(MCAP0_MAGIC)] == MCAP0_MAGIC:
        return data
    known = read_summary(data).proof is Proof.SOUND or next(scattered_chunks(data), None) is not None
    if not known:
        raise StorageError(f'{path} is no MCAP file: its first bytes are not those of one')
    return data


def _groups(chunks: list[Chunk]) -> Iterator[list[Chunk]]:
    """Yield chunks in their order, those together that unpack into some `_AT_ONCE` bytes."""
    group, size = list[Chunk](), 0
    for chunk in chunks:
        group.append(chunk)
        size += min(chunk.size, unpacking_limit(chunk.end - chunk.begin))
        if size >= _AT_ONCE:
            yield group
            group, size = [], 0
    if group:
        yield group
