"""Keeps the last messages in memory and writes them, and what follows, when an event comes.

How long ago a message came is told by the steady clock, when it is taken: the system's clock may step.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.folders import snapshot_folder
from mount_recorder.offered_qos import OfferedQos
from mount_recorder.piece import Offers
from mount_recorder.queue import ITEM_OVERHEAD
from mount_recorder.schemas import schema_text
from mount_recorder.statement import Reception, excerpt_statement

MEMORY = 256 << 20  # bytes, chosen: 75 s of a full drive with the simulator's truth
AFTER = 10_000_000_000  # ns, chosen

_Item = tuple[
    str, bytes, int, int, int
]  # topic, message, arrival, sending; steady time at which it was taken


class SnapshotRule(NamedTuple):
    """What is kept: ns `before` and `after` an event, bytes of `memory` for what may come before one."""

    before: int
    after: int = AFTER
    memory: int = MEMORY


@dataclass(frozen=True)
class SnapshotFigures:
    """What a snapshot has at present."""

    recordings: int  # so far, the running one included
    running: bool
    held: float  # s that lie in memory
    held_bytes: int  # what they take, estimated from above; never more than the rule's
    short_of_memory: bool  # whether the memory is too small for the wished time


@dataclass(frozen=True)
class _Announced:
    type: str
    offers: Sequence[OfferedQos] | Offers
    latched: bool


class Snapshot:
    """Takes messages as a `BagWriter` does, but writes only around those of the topic `trigger`.

    The first event makes the recording `folder`, later ones `folder`_2, `folder`_3, ... An event while a
    recording still runs makes it longer instead. Each begins with the last `before` ns, or as much of them
    as `memory` holds, so two may overlap, and with the last message of each latched topic.
    """

    def __init__(
        self,
        folder: Path,
        trigger: str,
        rule: SnapshotRule,
        open_writer: Callable[[Path], BagWriter] = BagWriter,
        clock: Callable[[], int] = time.monotonic_ns,
    ):
        if folder.exists():
            raise RecordingError(f'{folder} exists already; a recording is never written over')
        self.folder = folder
        self.failure = ''
        self.folders: list[Path] = []
        self._trigger = trigger
        self._rule = rule
        self._open_writer = open_writer
        self._clock = clock
        self._topics: dict[str, _Announced] = {}
        self._receptions: dict[str, Reception] = {}
        self._ring: deque[_Item] = deque()
        self._ring_bytes = 0
        self._cut_by_memory = False
        self._latched: dict[str, _Item] = {}  # the last of each topic that has left the ring
        self._writer: BagWriter | None = None
        self._until = 0
        self._kept_before = 0
        self._size_before = 0
        self._wanted = 0

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return self._kept_before + (self._writer.kept if self._writer else 0)

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._writer.pending if self._writer else 0

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return self._size_before + (self._writer.size if self._writer else 0)

    def figures(self) -> SnapshotFigures:
        """Return what lies in memory and what was made of it."""
        ring = self._ring
        held = (ring[-1][4] - ring[0][4]) * 1e-9 if ring else 0.0
        running = self._writer is not None
        return SnapshotFigures(len(self.folders), running, held, self._ring_bytes, self._cut_by_memory)

    def unwritten(self, handed: int) -> int:
        """Return how many messages should stand on the disk and do not, once writing has failed."""
        return self._wanted - self.kept

    def attach(self, receptions: dict[str, Reception]) -> None:
        """Take the counts that the recordings shall tell of."""
        self._receptions = receptions

    def add_topic(
        self,
        name: str,
        type_name: str,
        offered_qos: Sequence[OfferedQos] | Offers = (),
        *,
        latched: bool = False,
    ) -> None:
        """Announce a topic, as `BagWriter.add_topic` does."""
        schema_text(type_name)  # refuses a type that is not installed now, not at the event
        self._topics[name] = _Announced(type_name, offered_qos, latched)

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int) -> None:
        """Take one message; raises `RecordingError` for an unknown topic and when the disk is full."""
        if self.failure:
            raise RecordingError(self.failure)
        if topic not in self._topics:
            raise RecordingError(f'topic {topic} is not announced; call add_topic before write')
        now = self._clock()
        item = (topic, raw, receive_time, publish_time, now)
        self._remember(item)
        is_event = topic == self._trigger
        if self._writer is not None and now > self._until:
            self._guard(self._end_recording)
        if is_event:
            self._until = now + self._rule.after
        if self._writer is not None:
            self._store(item)
        elif is_event:
            self._begin_recording()

    def flush(self) -> None:
        """Complete the chunk that is being filled."""
        if self._writer is not None:
            self._guard(self._writer.flush)

    def stop(self, why: str) -> None:
        """Close the recording that runs, if any, and raise `RecordingError` with the sentence `why`."""
        if self._writer is not None:
            self._guard(partial(self._writer.stop, why))
        self.failure = f'snapshots {self.folder} stopped: {why}'
        raise RecordingError(self.failure)

    def close(self) -> None:
        """Close the recording that runs, if any; what is only in memory is gone."""
        if self._writer is not None:
            self._guard(self._end_recording)

    def discard(self) -> None:
        """Forget everything; nothing is on the disk before `write`."""
        self._ring.clear()

    def _remember(self, item: _Item) -> None:
        ring = self._ring
        size = len(item[1]) + ITEM_OVERHEAD
        while ring and self._ring_bytes + size > self._rule.memory:
            self._cut_by_memory = True
            self._forget_oldest()
        ring.append(item)
        self._ring_bytes += size
        begin = item[4] - self._rule.before
        while ring[0][4] < begin:
            self._cut_by_memory = False  # the time is full
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        item = self._ring.popleft()
        self._ring_bytes -= len(item[1]) + ITEM_OVERHEAD
        if self._topics[item[0]].latched:
            self._latched[item[0]] = item

    def _begin_recording(self) -> None:
        self._guard(partial(self._open, snapshot_folder(self.folder, len(self.folders) + 1)))
        begin = self._ring[0][2]
        for topic, raw, _, sent, taken in self._latched.values():
            self._store((topic, raw, begin, sent, taken))
        for item in self._ring:
            self._store(item)

    def _open(self, folder: Path) -> None:
        writer = self._open_writer(folder)
        for name, topic in self._topics.items():
            writer.add_topic(name, topic.type, topic.offers, latched=topic.latched)
        writer.statement = partial(excerpt_statement, self._receptions)
        self.folders.append(folder)
        self._writer = writer

    def _store(self, item: _Item) -> None:
        assert self._writer is not None
        self._wanted += 1
        try:
            self._writer.write(*item[:4])
        except RecordingError as error:
            self.failure = str(error)
            raise

    def _end_recording(self) -> None:
        assert self._writer is not None
        writer, self._writer = self._writer, None
        try:
            writer.close()
        finally:
            self._kept_before += writer.kept
            self._size_before += writer.size

    def _guard(self, step: Callable[[], None]) -> None:
        try:
            step()
        except RecordingError as error:
            self.failure = str(error)
            raise
