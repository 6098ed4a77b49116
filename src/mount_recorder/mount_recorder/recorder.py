"""The core of the recorder: one thread receives, one writes, and a queue is between them.

Receiving is one append. Whatever the disk does, publishers never wait: the queue grows up to a limit
in bytes, and what does not fit is lost, counted and reported. In lock-step one thread does both, in turn:
no time passes while it writes, and two that take turns in one process cost more than the work.
"""

import shutil
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mount_recorder.bag_writer import BagWriter, Offers, RecordingError
from mount_recorder.event_window import ITEM_OVERHEAD, EventWindow, Item
from mount_recorder.folders import snapshot_folder
from mount_recorder.losses import Reception
from mount_recorder.schemas import schema_text
from mount_recorder.stamp_watch import StampWatch

MEMORY_LIMIT = 128 << 20  # bytes, chosen: half a minute of a full drive with the simulator's truth
_DRAIN_PERIOD = 0.02  # s, chosen: what a crash may cost besides the chunk being filled
_FLUSH_PERIOD = 0.08  # s, chosen: longest time that a chunk is filled; with the above a crash costs 0.12 s
_SPACE_PERIOD = 0.2  # s, chosen: a tenth of the reserve at 100 MB/s
_BATCH = 500  # messages, chosen: after so many the queue's room is given back to the receiving thread
_QUIET_PERIOD = 0.15  # s, chosen: several heartbeats of a writer, in which a missing message is repaired
_SETTLE_LIMIT = 5.0  # s, chosen

Receive = Callable[[bytes, int, int], None]
"""Takes (serialised message, time of arrival ns, time of sending ns)."""

Observe = Callable[[bytes], None]
"""Evaluates a serialised message."""


@dataclass(frozen=True)
class Unobserved:
    """Messages of a topic, all recorded, that its observer could not read: bytes of the last, and why."""

    count: int
    size: int
    why: str


class Recorder:
    """Takes serialised messages and writes them into the recording `folder` from `begin` to `end`.

    With a `window` it writes only around events: the first makes the recording `folder`, later ones
    `folder`_2, `folder`_3, ... An event while a recording still runs makes it longer.

    The functions that `add_topic` returns are all called by one thread, `begin` and `end` by any other. The
    writing is done by a thread of its own, or (`threaded` off) by whoever calls `poll`. The `observers`
    are called there too, each with the messages of its topic, and so is `on_loss`, with the number of
    messages for which the queue had no room since it was called last. A message on which an observer fails
    is recorded all the same and counted in `unobserved`; so is a failure of `on_loss`.

    The recording is closed before the disk has less than `free_reserve` bytes left.
    """

    def __init__(
        self,
        folder: Path,
        *,
        open_writer: Callable[[Path], BagWriter] = BagWriter,
        window: EventWindow | None = None,
        memory_limit: int = MEMORY_LIMIT,
        threaded: bool = True,
        free_reserve: int = 0,
        on_loss: Callable[[int], None] = lambda _: None,
    ):
        self.folder = folder
        self.window = window
        self.writers: list[BagWriter] = []
        self.receptions: dict[str, Reception] = {}
        self.observers: dict[str, Observe] = {}
        self.watches: dict[str, StampWatch] = {}
        self.unobserved: dict[str, Unobserved] = {}
        self.failure = ''
        self.begun = False
        self._new_writer = open_writer
        self._memory_limit = memory_limit
        self._free_reserve = free_reserve
        self._on_loss = on_loss
        self._topics: list[tuple[str, str, Offers, bool]] = []
        self._queue: deque[Item] = deque()
        self._queued_bytes = 0
        self._latched: dict[str, Item] = {}
        self._wanted = 0  # messages that a window has selected
        self._open = False
        self._gate = threading.Lock()  # of the queue, for a moment each
        self._writing = threading.Lock()
        self._turn_end = self._changed = self._space_checked = 0.0  # steady times, s
        self._kept_before = self._lost_before = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name='recorder', daemon=True) if threaded else None
        if shortage := self._shortage():
            raise RecordingError(f'recording {folder} cannot be started: {shortage}')
        if folder.exists():
            raise RecordingError(f'{folder} exists already; a recording is never written over')
        if window is None:
            self._open_writer()

    def add_topic(
        self, name: str, type_name: str, offers: Offers = tuple, *, latched: bool = False
    ) -> Receive:
        """Announce a topic and return the function that takes its messages.

        Before `begin` it drops them, but keeps the last one of a `latched` topic for it. Raises `SchemaError`
        for a type that is not installed.
        """
        schema_text(type_name)
        self._topics.append((name, type_name, offers, latched))
        self.receptions[name] = Reception()
        if self.window is None:
            self.writers[0].add_topic(name, type_name, offers, latched=latched)
        elif latched:
            self.window.latched.add(name)

        def receive(raw: bytes, received: int, sent: int) -> None:
            with self._gate:
                if self._open:
                    self._put((name, raw, received, sent))
                elif latched:
                    self._latched[name] = name, raw, received, sent

        return receive

    def begin(self) -> None:
        """Record from now on, the kept latched messages first; raises `RecordingError` a second time."""
        if self.begun:
            raise RecordingError(f'recording {self.folder} has ended; configure a new one')
        with self._gate:
            self.begun = self._open = True
            for item in sorted(self._latched.values(), key=lambda item: item[2]):
                self._put(item)
            self._changed = self._space_checked = time.monotonic()
        if self._thread is not None:
            self._thread.start()

    def poll(self) -> bool:
        """Write what is queued, a few times per 0.1 s; for a recorder without a thread. Returns False."""
        if self._open and time.monotonic() - self._turn_end > _DRAIN_PERIOD:
            with self._writing:
                if self._open:
                    self._take_turn()
        return False

    def end(self) -> None:
        """Wait until no message is under way, write what is queued and close; safe to call twice.

        Raises `RecordingError` where the end of the file could not be written.
        """
        if self._open:
            self._settle()
            with self._gate:
                self._open = False
            self._ending.set()
            if self._thread is not None:
                self._thread.join()
            with self._writing:
                self._guarded(self._write_queued)
        self._note_missing()
        try:
            if self._writer is not None:
                self._writer.close()
        except RecordingError as error:
            self.failure = str(error)
            raise

    def discard(self) -> None:
        """Remove the recording of a recorder that never began."""
        for writer in self.writers:
            writer.discard()

    def figures(self) -> dict[str, int]:
        """Return what was done so far, by the keys of the diagnostics; sizes in bytes.

        `kept` is in complete chunks on the disk; `lost` did not fit into the queue, or came after a failure.
        """
        received = sum(entry.received for entry in self.receptions.values())
        overflowed = sum(entry.overflowed for entry in self.receptions.values())
        kept = self._kept
        wanted = received - overflowed if self.window is None else self._wanted
        return {
            'received': received,
            'kept': kept,
            'file_bytes': sum(writer.size for writer in self.writers),
            'queued': len(self._queue),
            'queued_bytes': self._queued_bytes,
            'lost': overflowed + (wanted - kept if self.failure else 0),
        }

    def figures_by_topic(self) -> dict[str, int]:
        """Return the same by topic: keys such as `missing.<topic>`."""
        figures = {f'lost.{name}': entry.overflowed for name, entry in self.receptions.items()}
        figures = {key: count for key, count in figures.items() if count}
        figures |= {f'malformed.{name}': entry.count for name, entry in list(self.unobserved.items())}
        for name, watch in self.watches.items():
            figures |= {f'missing.{name}': watch.lost, f'misdated.{name}': watch.misdated}
        return figures

    @property
    def last_stamp(self) -> int:
        """The latest stamp of all watched topics, ns."""
        return max((watch.last_stamp for watch in self.watches.values()), default=0)

    @property
    def _kept(self) -> int:
        return sum(writer.kept for writer in self.writers)

    @property
    def _writer(self) -> BagWriter | None:
        """The recording that is being made."""
        return self.writers[-1] if self.writers and not self.writers[-1].closed else None

    def _put(self, item: Item) -> None:
        reception = self.receptions[item[0]]
        reception.received += 1
        size = len(item[1]) + ITEM_OVERHEAD
        if self._queued_bytes + size > self._memory_limit:
            reception.overflowed += 1
        else:
            self._queued_bytes += size
            self._queue.append(item)

    def _settle(self) -> None:
        """Wait until messages cease, or until those come that arrived well after this call."""
        limit = time.monotonic() + _SETTLE_LIMIT
        latest = time.time_ns() + int(2e9 * _QUIET_PERIOD)
        before = -1
        while (received := self.figures()['received']) != before and time.monotonic() < limit:
            before = received
            self._ending.wait(_QUIET_PERIOD)
            with self._gate:
                if self._queue and self._queue[-1][2] > latest:
                    return

    # The writing.

    def _work(self) -> None:
        while not self._ending.wait(_DRAIN_PERIOD):
            self._take_turn()

    def _take_turn(self) -> None:
        self._guarded(self._write_queued)
        now, writer, kept = time.monotonic(), self._writer, self._kept
        self._turn_end = now
        if writer is None or not writer.pending or kept != self._kept_before:
            self._kept_before, self._changed = kept, now
        elif now - self._changed > _FLUSH_PERIOD:
            self._guarded(writer.flush)
        if now - self._space_checked > _SPACE_PERIOD:
            self._space_checked = now
            self._guarded(self._check_space)
        overflowed = sum(entry.overflowed for entry in self.receptions.values())
        if lost := overflowed - self._lost_before:
            self._lost_before = overflowed
            try:
                self._on_loss(lost)
            except Exception as error:
                # The border of the thread: what cannot be reported of a loss costs no more messages.
                self._note_unobserved('marks of losses', b'', error)

    def _write_queued(self) -> None:
        queue = self._queue
        for _ in range(-(-len(queue) // _BATCH)):
            batch = [queue.popleft() for _ in range(min(len(queue), _BATCH))]
            try:
                for item in batch:
                    self._store(item)
                    if item[0] in self.observers:
                        self._observe(item[0], item[1])
            finally:
                with self._gate:
                    self._queued_bytes -= sum(len(item[1]) + ITEM_OVERHEAD for item in batch)

    def _store(self, item: Item) -> None:
        """Write a message, or what the window selects: nothing without an event, then all it holds."""
        if self.window is None:
            self.writers[0].write(*item)
            return
        begins, items = self.window.add(item)
        if (begins or not items) and self._writer is not None:
            self._writer.close()
        if begins:
            self._open_writer()
        for each in items:
            self._wanted += 1
            self.writers[-1].write(*each)

    def _open_writer(self) -> None:
        writer = self._new_writer(snapshot_folder(self.folder, len(self.writers) + 1))
        writer.receptions, writer.excerpt = self.receptions, self.window is not None
        for name, type_name, offers, latched in self._topics:
            writer.add_topic(name, type_name, offers, latched=latched)
        self.writers.append(writer)

    def _observe(self, topic: str, raw: bytes) -> None:
        try:
            self.observers[topic](raw)
        except Exception as error:
            # Anybody may publish anything: what is wrong with one message ends no recording.
            self._note_unobserved(topic, raw, error)

    def _note_unobserved(self, topic: str, raw: bytes, error: Exception) -> None:
        count = self.unobserved[topic].count + 1 if topic in self.unobserved else 1
        why = f'{type(error).__name__}: {error}'.splitlines()[0]
        self.unobserved[topic] = Unobserved(count, len(raw), why)

    def _check_space(self) -> None:
        if shortage := self._shortage():
            self._note_missing()
            if self._writer is not None:
                self._writer.stop(shortage)
            raise RecordingError(f'recording {self.folder} stopped: {shortage}')

    def _shortage(self) -> str:
        """Return what is wrong where the disk has less than the reserve, empty while there is enough."""
        free = free_space(self.folder)
        if free >= self._free_reserve:
            return ''
        return (
            f'{free / 1e6:.0f} MB left on the disk of {self.folder}, less than the '
            f'{self._free_reserve / 1e6:.0f} MB that free_reserve keeps'
        )

    def _note_missing(self) -> None:
        for name, watch in self.watches.items():
            self.receptions[name].missing = watch.lost

    def _guarded(self, step: Callable[[], None]) -> None:
        try:
            if not self.failure:
                step()
        except Exception as error:
            # The border of the thread: a recorder that ends without a word would be the worst of all.
            known = isinstance(error, RecordingError)
            self.failure = str(error) if known else f'recording stopped: {type(error).__name__}: {error}'
        if self.failure:
            with self._gate:
                self._queue.clear()
                self._queued_bytes = 0


def free_space(folder: Path) -> int:
    """Return the free bytes of the disk that holds `folder`, or will hold it."""
    return shutil.disk_usage(next(place for place in (folder, *folder.parents) if place.exists())).free
