"""The core of the recorder: one thread receives, one writes, and a queue is between them.

Receiving is one append. Whatever the disk does, publishers never wait: the queue grows up to a limit
in bytes, and what does not fit is lost, counted and reported.
"""

import shutil
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mount_recorder.bag_writer import BagWriter, FindOffers, RecordingError
from mount_recorder.losses import Reception
from mount_recorder.stamp_watch import StampWatch

MEMORY_LIMIT = 128 << 20  # bytes, chosen: half a minute of a full drive with the simulator's truth
ITEM_OVERHEAD = 288
"""Bytes of memory per message besides its payload: tuples, numbers, head of the bytes (measured: 272)."""
_DRAIN_PERIOD = 0.02  # s, chosen: what a crash may cost besides the chunk being filled
_FLUSH_PERIOD = 0.08  # s, chosen: longest time that a chunk is filled; with the above a crash costs 0.12 s
_SPACE_PERIOD = 0.2  # s, chosen: a tenth of the reserve at 100 MB/s
_BATCH = 500  # messages, chosen: after so many the queue's room is given back to the receiving thread
_QUIET_PERIOD = 0.15  # s, chosen: several heartbeats of a writer, in which a missing message is repaired
_SETTLE_LIMIT = 5.0  # s, chosen

Receive = Callable[[bytes, int, int], None]
"""Takes (serialised message, time of arrival ns, time of sending ns)."""

Item = tuple[str, bytes, int, int]
"""Topic, message, times of arrival and of sending in ns."""


@dataclass(frozen=True)
class Unobserved:
    """Messages of a topic, all recorded, that its observer could not read: how many, what the last was."""

    count: int
    last: str


class Recorder:
    """Takes serialised messages and writes them into the recording `folder` from `begin` to `end`.

    The functions that `add_topic` returns are all called by one thread, `begin` and `end` by any other. The
    thread that writes calls the `observers` too, each with the messages of its topic, and `on_loss`, with the
    number of messages for which the queue had no room since it was called last. A message on which an
    observer fails is recorded all the same and counted in `unobserved`; so is a failure of `on_loss`.

    The recording is closed before the disk has less than `free_reserve` bytes left.
    """

    def __init__(
        self,
        folder: Path,
        *,
        open_writer: Callable[[Path], BagWriter] = BagWriter,
        memory_limit: int = MEMORY_LIMIT,
        free_reserve: int = 0,
        on_loss: Callable[[int], None] = lambda _: None,
    ):
        self.folder = folder
        self.receptions: dict[str, Reception] = {}
        self.observers: dict[str, Callable[[bytes], None]] = {}
        self.watches: dict[str, StampWatch] = {}
        self.unobserved: dict[str, Unobserved] = {}
        self.failure = ''
        self.begun = False
        self._memory_limit = memory_limit
        self._free_reserve = free_reserve
        self._on_loss = on_loss
        self._queue: deque[Item] = deque()
        self._queued_bytes = 0
        self._latched: dict[str, Item] = {}
        self._open = False
        self._gate = threading.Lock()  # of the queue, for a moment each
        self._changed = self._space_checked = 0.0  # steady times, s
        self._kept_before = self._lost_before = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name='recorder', daemon=True)
        if shortage := self._shortage():
            raise RecordingError(f'recording {folder} cannot be started: {shortage}')
        self._writer = open_writer(folder)
        self._writer.receptions = self.receptions

    def add_topic(
        self, name: str, type_name: str, find_offers: FindOffers = tuple, *, latched: bool = False
    ) -> Receive:
        """Announce a topic and return the function that takes its messages.

        Before `begin` it drops them, but keeps the last one of a `latched` topic for it. Raises `SchemaError`
        for a type that is not installed.
        """
        self._writer.add_topic(name, type_name, find_offers)
        self.receptions[name] = Reception()

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
        self._thread.start()

    def end(self) -> None:
        """Wait until no message is under way, write what is queued and close; safe to call twice.

        Raises `RecordingError` where the end of the file could not be written.
        """
        if self._open:
            self._settle()
            with self._gate:
                self._open = False
            self._ending.set()
            self._thread.join()
            self._guarded(self._write_queued)
        self._note_missing()
        try:
            self._writer.close()
        except RecordingError as error:
            self.failure = str(error)
            raise

    def discard(self) -> None:
        """Remove the recording of a recorder that never began."""
        self._writer.discard()

    def figures(self) -> dict[str, int]:
        """Return what was done so far, by the keys of the diagnostics; sizes in bytes.

        `kept` is in complete chunks on the disk; `lost` did not fit into the queue, or came after a failure.
        """
        received = sum(entry.received for entry in self.receptions.values())
        kept = self._writer.kept
        return {
            'received': received,
            'kept': kept,
            'file_bytes': self._writer.size,
            'queued': len(self._queue),
            'queued_bytes': self._queued_bytes,
            'lost': received - kept if self.failure else self._overflowed,
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
    def _overflowed(self) -> int:
        return sum(entry.overflowed for entry in self.receptions.values())

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
            self._guarded(self._write_queued)
            now, writer = time.monotonic(), self._writer
            if not writer.pending or writer.kept != self._kept_before:
                self._kept_before, self._changed = writer.kept, now
            elif now - self._changed > _FLUSH_PERIOD:
                self._guarded(writer.flush)
            if now - self._space_checked > _SPACE_PERIOD:
                self._space_checked = now
                self._guarded(self._check_space)
            if lost := self._overflowed - self._lost_before:
                self._lost_before += lost
                self._observe('marks of losses', b'', lambda _: self._on_loss(lost))

    def _write_queued(self) -> None:
        queue = self._queue
        for _ in range(-(-len(queue) // _BATCH)):
            batch = [queue.popleft() for _ in range(min(len(queue), _BATCH))]
            try:
                for item in batch:
                    self._writer.write(*item)
                    if item[0] in self.observers:
                        self._observe(item[0], item[1], self.observers[item[0]])
            finally:
                with self._gate:
                    self._queued_bytes -= sum(len(item[1]) + ITEM_OVERHEAD for item in batch)

    def _observe(self, what: str, raw: bytes, observe: Callable[[bytes], None]) -> None:
        try:
            observe(raw)
        except Exception as error:
            # Anybody may publish anything, and what is wrong with one message ends no recording. Nor does
            # a loss that cannot be reported.
            count = self.unobserved[what].count + 1 if what in self.unobserved else 1
            why = f'{type(error).__name__}: {error}'.splitlines()[0]
            self.unobserved[what] = Unobserved(count, f'{len(raw)} bytes; {why}')

    def _check_space(self) -> None:
        if shortage := self._shortage():
            self._note_missing()
            self._writer.stop(shortage)

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
