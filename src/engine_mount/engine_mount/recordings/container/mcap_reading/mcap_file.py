"""Reads one MCAP file as far as it is proven whole: complete, cut off by a crash, or damaged in places.

Where the summary at the end is sound, it says where the chunks stand, and these are unpacked when a topic
is asked for. Where it is not, the file is searched (`Search`).
"""

import mmap
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
from mcap.records import Attachment, Statistics
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from engine_mount.recordings.container.mcap_reading.chunk_index import can_be_there, take_checksums
from engine_mount.recordings.container.mcap_reading.chunk_table import Places
from engine_mount.recordings.container.mcap_reading.chunks import (
    RECORD,
    Chunk,
    Contents,
    contents_of,
    left_out,
    scattered_chunks,
)
from engine_mount.recordings.container.mcap_reading.declarations import Declarations
from engine_mount.recordings.container.mcap_reading.passing import passing
from engine_mount.recordings.container.mcap_reading.search import Search, Stretch
from engine_mount.recordings.container.mcap_reading.summary import (
    Hash,
    Proof,
    Summary,
    covered,
    data_proof,
    hashed,
    parsed_attachment,
    read_summary,
)
from engine_mount.recordings.container.mcap_reading.tally import Tally
from engine_mount.recordings.container.mcap_reading.unpacker import Unpacker
from engine_mount.recordings.container.mcap_reading.walk import Walk
from engine_mount.recordings.container.message_compression import plain
from engine_mount.recordings.container.stored import ACCOUNTS, StorageError, StoredMessages
from engine_mount.recordings.container.whole_files import COMPRESSED_SUFFIXES, FileError, mapped


class McapFile:
    """Topics, metadata and messages of one file; what is wrong with it stands in `warnings`."""

    def __init__(self, path: Path):
        self.path = path
        self.warnings: list[str] = []
        self.lost_beside: list[str] = []  # names of metadata and attachments
        self.unexplained: list[Stretch] = []  # what is neither a chunk nor a record that is understood
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        self._damaged: set[int] = set()  # positions of chunks
        self._undeclared = 0  # messages whose topic is not known
        self._tally = Tally()
        self._data = _opened(path)
        self._data_proof: Proof | None = None
        self._crc: int | None = None  # of the data section, once it was taken
        summary = read_summary(self._data)
        self._summary_proof, self._summary_begin = summary.proof, summary.begin
        if _is_enough(summary, len(self._data)):
            self._take_summary(summary)
        else:
            self._take_found()
        self.topics = self._declared.topics()
        self.metadata, self.records = self._walk.metadata, self._walk.records
        self._checksums_differ = bool(self.chunks.unprotected and self.chunks.protected)
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

    def message_counts(self) -> dict[int, int]:
        """Return the number of messages by topic: as written where that is proven, else as readable."""
        return dict(self._tally.counts)

    def time_range(self) -> tuple[int, int] | None:
        """Return the earliest and the latest log time (ns), None for a file without messages."""
        return self._tally.times

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        """Yield the messages of `topics` in the order of the file, unpacked where each is packed."""
        self.data_proof()
        wanted = np.array(sorted(topics), np.int64)
        for places in self.passing(self.chunks.holding(topics)):
            for place in places.tolist():
                yield from self.messages_in(place, wanted)
        found = self._walk.loose_messages().of(wanted)
        if len(found):
            yield plain(found)

    def messages_in(self, place: int, wanted: NDArray[np.int64]) -> Iterator[StoredMessages]:
        """Yield the messages of the topics `wanted` in one chunk together, if there are any."""
        contents = self.contents(self.chunks[place])
        if contents is not None and len(found := contents.messages.of(wanted)):
            yield plain(found)

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attachments, without those that are damaged."""
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

    @property
    def plain(self) -> bool:
        """Whether a checksum vouches for all of it, and its messages are in chunks that tell their topics."""
        if not self.proven or self._walk.loose or self.data_proof() is not Proof.SOUND:
            return False
        return not self._damaged and self.chunks.plain

    @property
    def has_loose_messages(self) -> bool:
        """Whether messages stand beside the chunks."""
        return bool(self._walk.loose)

    def is_damaged(self, chunk: Chunk) -> bool:
        """Return whether a chunk is known to be damaged; others are taken for sound until they are read."""
        return chunk.position in self._damaged

    def unpacker(self) -> Unpacker:
        """Return what unpacks the chunks of a `plain` file, which need no checksum of their own."""
        return Unpacker(self._data, self.chunks)

    def passing(self, places: Places) -> Iterator[Places]:
        """Yield the numbers of chunks, near ones together; little of the file is in memory at once."""
        return passing(self._data, self.chunks, places)

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
        return self._summary_begin if self.proven else self._walk.data_end

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
        return bool(self._walk.loose) or self.chunks.unprotected > 0

    def _take_summary(self, summary: Summary) -> None:
        """Take what a summary tells that is sound and enough."""
        self.chunks = summary.chunks
        for places in self.passing(np.arange(len(self.chunks))):
            take_checksums(np.frombuffer(self._data, np.uint8), self.chunks.rows[places[0] : places[-1] + 1])
        self._declared = Declarations(summary.channels, summary.schemas)
        self._walk = Walk(self._data, self._declared, self._warn)
        self._walk_between_chunks(summary.begin)
        self._closed = True
        if (statistics := summary.statistics) is not None:
            self._tally.counts = dict(statistics.channel_message_counts)
            self._take_times(statistics)
        for index in summary.beside:
            if index.offset not in self._walk.beside_at and index.name not in ACCOUNTS:
                self.lost_beside.append(index.name)
                self._warn(f'{index.name}, metadata or attachment at byte {index.offset}, is damaged')
        if self._data[-len(MCAP0_MAGIC) :] != MCAP0_MAGIC:
            self._warn('its last bytes are damaged; all else is read')

    def _walk_between_chunks(self, summary_begin: int) -> None:
        begins, limits = self.chunks.gaps(len(MCAP0_MAGIC), summary_begin)
        for place in np.flatnonzero(begins < limits):
            self._walk.through(int(begins[place]), int(limits[place]))
        # A file with chunks has its messages there; a record that says otherwise needs a proof.
        if self._walk.loose and self.chunks and self.data_proof() is not Proof.SOUND:
            self._walk.drop_loose()

    def _take_times(self, statistics: Statistics) -> None:
        """Take the times of the chunks, which are nearer to the messages than the statistics of the file."""
        self._tally.times = self.chunks.times
        if self._walk.loose:
            self._tally.widen(self._walk.loose_messages())
        told = statistics.message_start_time, statistics.message_end_time
        if self._tally.times is not None and told != self._tally.times:
            self._warn('its statistics tell of other times than its chunks; believed are the chunks')

    def _take_found(self) -> None:
        """Take what a search finds."""
        damaged = self._summary_proof is Proof.WRONG
        found = Search(self._data, self._warn, damaged_summary=damaged)
        self.chunks, self.tail, self.unexplained = found.chunks, found.tail, found.unexplained
        self._declared, self._walk, self._tally = found.declared, found.walk, found.tally
        self._closed, self._damaged, self._undeclared = found.closed, found.damaged, found.undeclared

    def _note_missing_checksums(self) -> None:
        without = self.chunks.unprotected
        if without:
            what = f'{without} of its {len(self.chunks)} chunks carry no checksum'
            why = 'while others do' if self._checksums_differ else 'as their writer chose'
            self._warn(f'{what}, {why}: a damaged number in them would go unseen')
        elif self._walk.loose and self.data_proof() is not Proof.SOUND:
            self._warn('its messages are under no sound checksum: a damaged number in them would go unseen')

    def _warn(self, sentence: str) -> None:
        self.warnings.append(f'{self.path.name}: {sentence}')


def _is_enough(summary: Summary, size: int) -> bool:
    """Return whether the summary of a file of so many bytes is sound and tells all that is asked of it."""
    statistics = summary.statistics
    if summary.proof is not Proof.SOUND or statistics is None:
        return False
    if statistics.chunk_count != len(summary.chunks) or not can_be_there(summary.chunks, size):
        return False
    if statistics.channel_count > len(summary.channels) or statistics.schema_count > len(summary.schemas):
        return False  # not repeated in the summary
    return all(channel in summary.channels for channel in statistics.channel_message_counts)


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
