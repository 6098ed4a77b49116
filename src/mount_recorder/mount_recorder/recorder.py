"""The core of the recorder: one thread receives, one writes, and a queue is between them.

Receiving is one append. Whatever the disk does, publishers never wait: the queue grows up to a limit
in bytes, and what does not fit is lost, counted and reported. In lock-step one thread does both, in turn:
no time passes while it writes, and two that take turns in one process cost more than the work.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from mount_recorder.bag_writer import RecordingError
from mount_recorder.queue import Item, ReceivedQueue
from mount_recorder.sink import Sink
from mount_recorder.space import SpaceGuard
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

Observe = Callable[[bytes, int], None]
"""Looks at (serialised message, time of arrival ns)."""


@dataclass(frozen=True)
class RecorderFigures:
    """What the recorder has done; sizes in bytes."""

    received: int
    kept: int  # in complete chunks on the disk
    file_size: int
    queued: int
    queued_bytes: int
    lost: int  # did not fit into the queue, or came after the disk was full
    failure: str


@dataclass(frozen=True)
class Unobserved:
    """Messages of a topic, all recorded, that its observer could not read: bytes of the last, and why."""

    count: int
    size: int
    why: str


class Recorder:
    """Takes serialised messages of announced topics and writes them from `begin` to `end`.

    The functions that `receiver` and `latched_receiver` return are all called by one thread, `begin`
    and `end` by any other. The writing is done by a thread of its own, or (`threaded` off) by whoever
    calls `poll`. What `watch` and `observe` take is called where the writing is done, and so is
    `on_loss`, with the number of messages for which the queue had no room since it was called last.
    A message on which an observer fails is recorded all the same and counted in `unobserved`; so is a
    failure of `on_loss`.
    """

    def __init__(
        self,
        writer: Sink,
        *,
        memory_limit: int = MEMORY_LIMIT,
        threaded: bool = True,
        space: SpaceGuard | None = None,
        on_loss: Callable[[int], None] = lambda _: None,
    ):
        self.watches: dict[str, StampWatch] = {}
        self.unobserved: dict[str, Unobserved] = {}
        self.begun = False
        self._writer = writer
        self._space = space
        self._on_loss = on_loss
        self._observers: dict[str, Observe] = {}
        self._queue = ReceivedQueue(memory_limit)
        self._open = False
        self._gate = threading.Lock()
        self._latched: dict[str, Item] = {}
        self._handed = 0  # to the writer, or thrown away after it failed
        self._failure = ''
        self._turn_end = self._changed = self._looked = 0.0  # steady times, s
        self._kept_before = self._lost_before = 0
        self._writing = threading.Lock()
        self._ending = threading.Event()
        self._threaded = threaded
        self._thread = threading.Thread(target=self._work, name='recorder', daemon=True)
        writer.attach(self._queue.receptions)

    def receiver(self, topic: str) -> Receive:
        """Return the function that takes the messages of `topic`; before `begin` it drops them."""
        take = self._queue.taker(topic)

        def receive(raw: bytes, received: int, sent: int) -> None:
            if self._open:
                take((topic, raw, received, sent))

        return receive

    def latched_receiver(self, topic: str) -> Receive:
        """Return the same for a latched topic: the last message before `begin` is kept for it."""
        take = self._queue.taker(topic)

        def receive(raw: bytes, received: int, sent: int) -> None:
            item = (topic, raw, received, sent)
            with self._gate:
                if self._open:
                    take(item)
                else:
                    self._latched[topic] = item

        return receive

    def watch(self, topic: str, rate: float, stamp_of: Callable[[bytes], int]) -> StampWatch:
        """Count missing samples of `topic`, which has `rate` in Hz; `stamp_of` returns ns."""
        watch = self.watches[topic] = StampWatch(rate)
        self.observe(topic, lambda raw, _: watch.add(stamp_of(raw)))
        return watch

    def observe(self, topic: str, observe: Observe) -> None:
        """Show each message of `topic` to `observe`, instead of to the one before."""
        self._observers[topic] = observe

    def begin(self) -> None:
        """Record from now on, the kept latched messages first; raises `RecordingError` a second time."""
        if self.begun:
            raise RecordingError(f'recording {self._writer.folder} has ended; configure a new one')
        with self._gate:
            self.begun = True
            for item in sorted(self._latched.values(), key=lambda item: item[2]):
                self._queue.taker(item[0])(item)
            self._changed = self._looked = time.monotonic()
            self._open = True
        if self._threaded:
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
            self._open = False
            self._ending.set()
            if self._threaded:
                self._thread.join()
            with self._writing:
                self._guarded(self._write_queued)
        self._note_missing()
        try:
            self._writer.close()
        except RecordingError as error:
            self._failure = str(error)
            raise

    def figures(self) -> RecorderFigures:
        """Return what was done so far."""
        return RecorderFigures(
            received=self._queue.received,
            kept=self._writer.kept,
            file_size=self._writer.size,
            queued=len(self._queue),
            queued_bytes=self._queue.size,
            lost=self._queue.overflowed + (self._writer.unwritten(self._handed) if self._failure else 0),
            failure=self._failure,
        )

    def overflowed(self) -> dict[str, int]:
        """Return how many messages of each topic did not fit into the queue, where there are any."""
        return {name: entry.overflowed for name, entry in self._queue.receptions.items() if entry.overflowed}

    def received_on(self, topic: str) -> int:
        """Return how many messages of `topic` came since `begin`."""
        entry = self._queue.receptions.get(topic)
        return entry.received if entry is not None else 0

    @property
    def last_stamp(self) -> int:
        """The latest stamp of all watched topics, ns."""
        return max((watch.last_stamp for watch in self.watches.values()), default=0)

    def _settle(self) -> None:
        """Wait until messages cease, or until those come that arrived well after this call."""
        limit = time.monotonic() + _SETTLE_LIMIT
        latest = time.time_ns() + int(2e9 * _QUIET_PERIOD)
        before = -1
        while self._queue.received != before and time.monotonic() < limit:
            before = self._queue.received
            self._ending.wait(_QUIET_PERIOD)
            if self._queue.newest_arrival > latest:
                return

    # The writing.

    def _work(self) -> None:
        while not self._ending.wait(_DRAIN_PERIOD):
            self._take_turn()

    def _take_turn(self) -> None:
        self._guarded(self._write_queued)
        now = self._turn_end = time.monotonic()
        if self._writer.kept != self._kept_before or not self._writer.pending:
            self._kept_before, self._changed = self._writer.kept, now
        elif now - self._changed > _FLUSH_PERIOD:
            self._guarded(self._writer.flush)
        if now - self._looked > _SPACE_PERIOD:
            self._looked = now
            self._guarded(self._look_at_space)
        lost, self._lost_before = self._queue.overflowed - self._lost_before, self._queue.overflowed
        if lost:
            try:
                self._on_loss(lost)
            except Exception as error:
                # The border of the thread: what cannot be told of a loss costs no more messages.
                self._note_unobserved('marks of losses', b'', error)

    def _write_queued(self) -> None:
        rest = len(self._queue)
        while rest > 0:
            self._write_batch(min(rest, _BATCH))
            rest -= _BATCH

    def _write_batch(self, count: int) -> None:
        take, write, observers = self._queue.pop, self._writer.write, self._observers
        taken = taken_bytes = 0
        try:
            for taken in range(1, count + 1):  # noqa: B007 - also read after an exception
                topic, raw, received, sent = take()
                taken_bytes += len(raw)
                write(topic, raw, received, sent)
                if topic in observers:
                    try:
                        observers[topic](raw, received)
                    except Exception as error:
                        # Anybody may publish anything: what is wrong with one message ends no recording.
                        self._note_unobserved(topic, raw, error)
        finally:
            self._handed += taken
            self._queue.free(taken, taken_bytes)

    def _note_unobserved(self, topic: str, raw: bytes, error: Exception) -> None:
        before = self.unobserved.get(topic)
        count = 1 if before is None else before.count + 1
        why = f'{type(error).__name__}: {error}'.splitlines()[0]
        self.unobserved[topic] = Unobserved(count, len(raw), why)

    def _look_at_space(self) -> None:
        shortage = self._space.shortage() if self._space is not None else ''
        if shortage:
            self._note_missing()
            self._writer.stop(shortage)

    def _note_missing(self) -> None:
        for name, watch in self.watches.items():
            self._queue.reception(name).missing = watch.lost

    def _guarded(self, step: Callable[[], None]) -> None:
        try:
            if not self._failure:
                step()
        except Exception as error:
            # The border of the thread: a recorder that ends without a word would be the worst of all.
            known = isinstance(error, RecordingError)
            self._failure = str(error) if known else f'recording stopped: {type(error).__name__}: {error}'
        if self._failure:
            self._handed += self._queue.discard()
