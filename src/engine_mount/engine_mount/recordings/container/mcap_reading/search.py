"""An MCAP file without a sound summary: walked record by record, and searched for chunks.

Whatever the checksums of chunks prove is taken, wherever it stands. Declarations of topics count more where
a checksum covers them.
"""

import mmap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.container.mcap_reading.chunk_table import ChunkTable, chunk_table
from engine_mount.recordings.container.mcap_reading.chunks import (
    RECORD,
    Chunk,
    explore,
    left_out,
    partial_chunk,
    scattered_chunks,
)
from engine_mount.recordings.container.mcap_reading.declarations import Declarations
from engine_mount.recordings.container.mcap_reading.passing import passing
from engine_mount.recordings.container.mcap_reading.summary import Proof, data_proof
from engine_mount.recordings.container.mcap_reading.tally import Tally
from engine_mount.recordings.container.mcap_reading.walk import Walk


@dataclass(frozen=True)
class Stretch:
    """A part of the file in which something is lost: bytes from `begin` to `end`."""

    begin: int
    end: int


class Search:
    """What was found in a file: chunks, topics, messages beside them, and what is known to be lost."""

    def __init__(self, data: mmap.mmap, warn: Callable[[str], None], *, damaged_summary: bool):
        self._data, self._warn = data, warn
        self.walk = Walk(data, Declarations(), warn)
        self.chunks: ChunkTable = chunk_table(())
        self.declared = Declarations()
        self.tally = Tally()
        self.damaged: set[int] = set()  # positions of chunks
        self.unexplained: list[Stretch] = []  # what is neither a chunk nor a record that is understood
        self.undeclared = 0  # messages whose topic is not known
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        found = self._walked()
        if self.closed:  # behind the end of the messages, what passes for one is a damaged declaration
            self.walk.loose = [place for place in self.walk.loose if place < self.walk.data_end]
        if damaged_summary:
            warn('the summary at its end is damaged; its chunks are searched for')
        self._explore(found)
        self._take_what_is_loose(trusted=self._whole and not damaged_summary)
        self._forget_undeclared()

    @property
    def closed(self) -> bool:
        """Whether the writer came to the end of its messages."""
        return bool(self.walk.data_end)

    @property
    def _whole(self) -> bool:
        return self.closed and not self.damaged and not self.unexplained

    @property
    def _proven(self) -> bool:
        """Whether nothing is known to be lost and a checksum vouches for all of it."""
        return self._whole and data_proof(self._data, self.walk.data_end) is Proof.SOUND

    def _walked(self) -> list[Chunk]:
        """Return the chunks, after a walk through all records and, if need be, a search."""
        found: list[Chunk] = []
        end = self.walk.through(len(MCAP0_MAGIC), len(self._data), found)
        if self.walk.footer_found and self._data[end:] == MCAP0_MAGIC:
            return found
        self.tail = self._tail(end)
        found = self._with_scattered(found)
        self._note_unexplained(found, end)
        kept = f'read up to byte {end}, {len(found)} whole chunks'
        messages = 'all messages are there' if self._whole else kept
        self._warn(f'ends without its footer, as after a crash: {messages}')
        return found

    def _tail(self, position: int) -> Chunk | None:
        """Return the chunk that begins at `position` and ends, by its own account, behind the file's end."""
        if position + RECORD.size > len(self._data):
            return None
        opcode, length = RECORD.unpack_from(self._data, position)
        if opcode != Opcode.CHUNK or position + RECORD.size + length <= len(self._data):
            return None
        return partial_chunk(self._data, position)

    def _with_scattered(self, walked: list[Chunk]) -> list[Chunk]:
        """Return instead of what the walk found all chunks of the file that their checksums prove."""
        found = {chunk.position: chunk for chunk in scattered_chunks(self._data)}
        found |= {chunk.position: chunk for chunk in walked}
        kept: list[Chunk] = []
        for _, chunk in sorted(found.items()):
            inside = bool(kept) and chunk.position < kept[-1].end
            if not inside and explore(self._data, chunk):
                kept.append(chunk)
        loose = self.walk.loose
        self.walk.loose = [place for place in loose if not any(_holds(chunk, place) for chunk in kept)]
        return kept

    def _note_unexplained(self, chunks: Sequence[Chunk], walked: int) -> None:
        begins, limits = chunk_table(chunks).gaps(len(MCAP0_MAGIC), len(self._data))
        for begin, limit in zip(begins.tolist(), limits.tolist(), strict=True):
            understood = self.walk.understood(begin, limit, walked)
            if understood < limit and not 0 < self.walk.data_end <= understood:
                self.unexplained.append(Stretch(understood, limit))
        for stretch in self.unexplained:
            if stretch.end < len(self._data):
                self._warn(f'bytes {stretch.begin} to {stretch.end} are damaged and left out')

    def _explore(self, chunks: Sequence[Chunk]) -> None:
        """Take what the messages in chunks say of topics, counts and times."""
        for places in passing(self._data, chunk_table(chunks), np.arange(len(chunks))):
            for place in places.tolist():
                self._take(chunks[place])
        self.chunks = chunk_table(chunks)

    def _take(self, chunk: Chunk) -> None:
        if not explore(self._data, chunk):
            self.damaged.add(chunk.position)
            self._warn(left_out(chunk))
            return
        for opcode, content in chunk.declarations:
            self.declared.take(opcode, content)
        for channel, count in chunk.counts.items():
            self.tally.count(channel, count)
        if chunk.counts:
            self.tally.widen_to(chunk.start_time, chunk.end_time)

    def _take_what_is_loose(self, *, trusted: bool) -> None:
        """Take declarations and messages outside of chunks: where there is nothing better, or no doubt."""
        if not self.chunks or trusted:
            self.declared = self.declared.over(self.walk.declared)
        if self.walk.loose and self.chunks and not self._proven:
            self.walk.drop_loose()
        if self.walk.loose:
            self.tally.add(self.walk.loose_messages())

    def _forget_undeclared(self) -> None:
        for channel in self.tally.counts.keys() - self.declared.channels.keys():
            count = self.tally.counts.pop(channel)
            self._warn(f'{count} messages of channel {channel} are left out: their topic is not known')
            self.undeclared += count


def _holds(chunk: Chunk, position: int) -> bool:
    return chunk.position <= position < chunk.end
