"""Keeps the last messages in memory and writes them, and what follows, when an event comes.

The age of a message counts on the steady clock from when it is taken: the system's clock may step.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from mount_recorder.bag_writer import BagWriter, Offers, RecordingError
from mount_recorder.folders import snapshot_folder
from mount_recorder.losses import Reception, loss_statement
from mount_recorder.metadata import OfferedQos
from mount_recorder.queue import ITEM_OVERHEAD
from mount_recorder.schemas import schema_text

MEMORY = 256 << 20  # bytes, chosen: 75 s of a full drive with the simulator's truth
AFTER = 10_000_000_000  # ns, chosen


class _Item(NamedTuple):
    topic: str
    raw: bytes
    received: int  # ns of the system's clock
    sent: int
    taken: int  # ns of the steady clock


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
        self._is_latched: dict[str, bool] = {}
        self._add_topics: list[Callable[[BagWriter], None]] = []
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
        held = (ring[-1].taken - ring[0].taken) * 1e-9 if ring else 0.0
        running = self._writer is not None
        return SnapshotFigures(len(self.folders), running, held, self._ring_bytes, self._cut_by_memory)

    def unwritten(self, handed: int) -> int:
        """Return how many messages should stand on the disk and do not, once writing has failed."""
        return self._wanted - self.kept

    def attach(self, receptions: dict[str, Reception]) -> None:
        """Take the recorder's counts, from which each recording states the losses."""
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
        self._is_latched[name] = latched

        def add(writer: BagWriter) -> None:
            writer.add_topic(name, type_name, offered_qos, latched=latched)

        self._add_topics.append(add)

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int) -> None:
        """Take one message; raises `RecordingError` for an unknown topic and when the disk is full."""
        if self.failure:
            raise RecordingError(self.failure)
        if topic not in self._is_latched:
            raise RecordingError(f'topic {topic} is not announced; call add_topic before write')
        now = self._clock()
        item = _Item(topic, raw, receive_time, publish_time, now)
        self._remember(item)
        with self._failure_kept():
            if self._writer is not None and now > self._until:
                self._end_recording()
            if topic == self._trigger:
                self._until = now + self._rule.after
            if self._writer is not None:
                self._store(self._writer, item)
            elif topic == self._trigger:
                self._begin_recording()

    def flush(self) -> None:
        """Complete the chunk that is being filled."""
        if self._writer is not None:
            with self._failure_kept():
                self._writer.flush()

    def stop(self, why: str) -> None:
        """Close the recording that runs, if any, and raise `RecordingError` with the sentence `why`."""
        if self._writer is not None:
            with self._failure_kept():
                self._writer.stop(why)
        self.failure = f'snapshots {self.folder} stopped: {why}'
        raise RecordingError(self.failure)

    def close(self) -> None:
        """Close the recording that runs, if any; what is only in memory is gone."""
        if self._writer is not None:
            with self._failure_kept():
                self._end_recording()

    def discard(self) -> None:
        """Forget everything; nothing is on the disk before `write`."""
        self._ring.clear()

    def _remember(self, item: _Item) -> None:
        ring = self._ring
        size = len(item.raw) + ITEM_OVERHEAD
        while ring and self._ring_bytes + size > self._rule.memory:
            self._cut_by_memory = True
            self._forget_oldest()
        ring.append(item)
        self._ring_bytes += size
        begin = item.taken - self._rule.before
        while ring[0].taken < begin:
            self._cut_by_memory = False  # the time is full
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        item = self._ring.popleft()
        self._ring_bytes -= len(item.raw) + ITEM_OVERHEAD
        if self._is_latched[item.topic]:
            self._latched[item.topic] = item

    def _begin_recording(self) -> None:
        folder = snapshot_folder(self.folder, len(self.folders) + 1)
        writer = self._open_writer(folder)
        for add_topic in self._add_topics:
            add_topic(writer)
        writer.statement = partial(loss_statement, self._receptions, excerpt=True)
        self.folders.append(folder)
        self._writer = writer
        for item in self._latched.values():
            self._store(writer, item._replace(received=self._ring[0].received))
        for item in self._ring:
            self._store(writer, item)

    def _store(self, writer: BagWriter, item: _Item) -> None:
        self._wanted += 1
        writer.write(*item[:4])

    def _end_recording(self) -> None:
        writer, self._writer = self._writer, None
        if writer is None:
            return
        try:
            writer.close()
        finally:
            self._kept_before += writer.kept
            self._size_before += writer.size

    @contextmanager
    def _failure_kept(self) -> Iterator[None]:
        try:
            yield
        except RecordingError as error:
            self.failure = str(error)
            raise
