"""An MCAP file without a sound summary: read record by record, and searched for chunks.

Whatever the checksums of chunks prove is taken, wherever it stands. Declarations of topics count more where
a checksum covers them.
"""

import mmap
from collections.abc import Callable
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from engine_mount.recordings.container.mcap_reading.chunks import (
    RECORD,
    Chunk,
    contents_of,
    gaps,
    left_out,
    partial_chunk,
    scattered_chunks,
)
from engine_mount.recordings.container.mcap_reading.summary import Proof, data_proof
from engine_mount.recordings.container.mcap_reading.walk import Declarations, Walk
from engine_mount.recordings.container.stored import StoredMessages, united


@dataclass(frozen=True)
class Stretch:
    """A part of the file in which something is lost: bytes from `begin` to `end`."""

    begin: int
    end: int


class Salvage:
    """What was found in a file: chunks, topics, messages beside them, and what is known to be lost."""

    def __init__(self, data: mmap.mmap, warn: Callable[[str], None], *, damaged_summary: bool):
        self._data, self._warn = data, warn
        self.walk = Walk(data, warn)
        self.chunks: list[Chunk] = []
        self.declared = Declarations()
        self.counts: dict[int, int] = {}  # of messages by channel
        self.times: tuple[int, int] | None = None  # of the messages, ns
        self.damaged: set[int] = set()  # positions of chunks
        self.unexplained: list[Stretch] = []  # what is neither a chunk nor a record that is understood
        self.undeclared = 0  # messages whose topic is not known
        self.tail: Chunk | None = None  # begun at the end of the file, cut off before its own
        unread = self._find_chunks()
        if self.closed:  # behind the end of the messages, what passes for one is a damaged declaration
            self.walk.loose = [place for place in self.walk.loose if place < self.walk.data_end]
        if damaged_summary:
            warn('the summary at its end is damaged; its chunks are searched for')
        for chunk in unread:
            if not self._read(chunk):
                self.damaged.add(chunk.position)
                self._warn(left_out(chunk))
        self._read_loose(trusted=self._whole and not damaged_summary)
        self._drop_undeclared()

    @property
    def closed(self) -> bool:
        """Whether the writer came to the end of its messages."""
        return bool(self.walk.data_end)

    @property
    def _whole(self) -> bool:
        return self.closed and not self.damaged and not self.unexplained

    def _find_chunks(self) -> list[Chunk]:
        """Walk through all records; where that does not lead to the footer, search for chunks and read them.

        Return the chunks that are not read yet.
        """
        walked: list[Chunk] = []
        end = self.walk.through(len(MCAP0_MAGIC), len(self._data), walked)
        if self.walk.footer_found and self._data[end:] == MCAP0_MAGIC:
            self.chunks = walked
            return walked
        self.tail = self._tail(end)
        found = {chunk.position: chunk for chunk in (*scattered_chunks(self._data), *walked)}
        for _, chunk in sorted(found.items()):
            inside = bool(self.chunks) and chunk.position < self.chunks[-1].end
            if not inside and self._read(chunk):
                self.chunks.append(chunk)
        self.walk.loose = [
            place
            for place in self.walk.loose
            if not any(chunk.position <= place < chunk.end for chunk in self.chunks)
        ]
        self._note_unexplained(end)
        kept = f'read up to byte {end}, {len(self.chunks)} whole chunks'
        messages = 'all messages are there' if self._whole else kept
        self._warn(f'ends without its footer, as after a crash: {messages}')
        return []

    def _tail(self, position: int) -> Chunk | None:
        """Return the chunk that begins at `position` and ends, by its own account, behind the file's end."""
        if position + RECORD.size > len(self._data):
            return None
        opcode, length = RECORD.unpack_from(self._data, position)
        if opcode != Opcode.CHUNK or position + RECORD.size + length <= len(self._data):
            return None
        return partial_chunk(self._data, position)

    def _note_unexplained(self, walked: int) -> None:
        for begin, limit in gaps(self.chunks, len(MCAP0_MAGIC), len(self._data)):
            understood = self.walk.understood(begin, limit, walked)
            if understood < limit and not 0 < self.walk.data_end <= understood:
                self.unexplained.append(Stretch(understood, limit))
        for stretch in self.unexplained:
            if stretch.end < len(self._data):
                self._warn(f'bytes {stretch.begin} to {stretch.end} are damaged and left out')

    def _read(self, chunk: Chunk) -> bool:
        """Take what the messages in a chunk tell of topics, counts and times; False if it is damaged."""
        contents = contents_of(self._data, chunk)
        if contents is None:
            return False
        for opcode, content in contents.declarations:
            self.declared.add(opcode, content)
        chunk.channels = frozenset(contents.messages.counts())
        if chunk.channels:
            chunk.start_time, chunk.end_time = contents.messages.time_range()
        self._count(contents.messages)
        return True

    def _count(self, messages: StoredMessages) -> None:
        for channel, count in messages.counts().items():
            self.counts[channel] = self.counts.get(channel, 0) + count
        if len(messages):
            self.times = united(self.times, messages.time_range())

    def _read_loose(self, *, trusted: bool) -> None:
        """Take declarations and messages outside of chunks: where there is nothing better, or no doubt."""
        if not self.chunks or trusted:
            for number, channel in self.walk.declared.channels.items():
                self.declared.channels.setdefault(number, channel)
            for number, schema in self.walk.declared.schemas.items():
                self.declared.schemas.setdefault(number, schema)
        proven = self._whole and data_proof(self._data, self.walk.data_end) is Proof.SOUND
        if self.walk.loose and self.chunks and not proven:
            self.walk.drop_loose()
        self._count(self.walk.loose_messages())

    def _drop_undeclared(self) -> None:
        for channel in self.counts.keys() - self.declared.channels.keys():
            count = self.counts.pop(channel)
            self._warn(f'{count} messages of channel {channel} are left out: their topic is not known')
            self.undeclared += count
