"""The core of the recorder: a queue between the thread that receives and the thread that writes.

Receiving is one append. Whatever the disk does, publishers never wait: the queue grows up to a limit
in bytes, and what does not fit is lost, counted and reported.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mount_bags.stamps import StampWatch
from mount_bags.writer import BagWriter, RecordingError

MEMORY_LIMIT = 64 * 1024 * 1024  # bytes, chosen: half a minute of a full drive with the simulator's truth
_DRAIN_PERIOD = 0.02  # s, chosen: what a crash may cost besides the chunk being filled
_FLUSH_PERIOD = 1.0  # s, chosen: the same where messages are rare
_QUIET_PERIOD = 0.15  # s, chosen: several heartbeats of a writer, in which a missing message is repaired
_SETTLE_LIMIT = 5.0  # s, chosen

Receive = Callable[[bytes, int, int], None]
"""Takes (serialised message, time of arrival ns, time of sending ns)."""

_Item = tuple[str, bytes, int, int]  # topic, message, times of arrival and of sending


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


class Recorder:
    """Takes serialised messages of announced topics and writes them from `begin` to `end`.

    The functions that `receiver` and `latched_receiver` return are all called by one thread, `begin`
    and `end` by any other.
    """

    def __init__(
        self,
        writer: BagWriter,
        *,
        memory_limit: int = MEMORY_LIMIT,
    ):
        self.watches: dict[str, StampWatch] = {}
        self.begun = False
        self._writer = writer
        self._memory_limit = memory_limit
        self._stamp_of: dict[str, Callable[[bytes], int]] = {}
        self._queue: deque[_Item] = deque()
        self._open = False
        self._gate = threading.Lock()
        self._latched: dict[str, _Item] = {}
        self._received = 0
        self._received_bytes = 0  # changed by the receiving thread alone
        self._drained_bytes = 0  # changed by the writing thread alone
        self._overflowed = 0
        self._handed = 0  # to the writer, or thrown away after it failed
        self._failure = ''
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name='recorder', daemon=True)

    def receiver(self, topic: str) -> Receive:
        """Return the function that takes the messages of `topic`; before `begin` it drops them."""

        def receive(raw: bytes, received: int, sent: int) -> None:
            if self._open:
                self._take((topic, raw, received, sent))

        return receive

    def latched_receiver(self, topic: str) -> Receive:
        """Return the same for a latched topic: the last message before `begin` is kept for it."""

        def receive(raw: bytes, received: int, sent: int) -> None:
            item = (topic, raw, received, sent)
            with self._gate:
                if self._open:
                    self._take(item)
                else:
                    self._latched[topic] = item

        return receive

    def watch(self, topic: str, rate: float, stamp_of: Callable[[bytes], int]) -> None:
        """Count missing samples of `topic`, which has `rate` in Hz; `stamp_of` returns ns."""
        self.watches[topic] = StampWatch(rate)
        self._stamp_of[topic] = stamp_of

    def begin(self) -> None:
        """Record from now on, the kept latched messages first; raises `RecordingError` a second time."""
        if self.begun:
            raise RecordingError(f'recording {self._writer.folder} has ended; configure a new one')
        with self._gate:
            self.begun = True
            for item in sorted(self._latched.values(), key=lambda item: item[2]):
                self._take(item)
            self._open = True
        self._thread.start()

    def end(self) -> None:
        """Wait until no message is under way, write what is queued and close; safe to call twice.

        Raises `RecordingError` where the end of the file could not be written.
        """
        if self._thread.is_alive():
            self._settle()
            self._open = False
            self._ending.set()
            self._thread.join()
        try:
            self._writer.close()
        except RecordingError as error:
            self._failure = str(error)
            raise

    def figures(self) -> RecorderFigures:
        """Return what was done so far."""
        kept = self._writer.kept
        unwritten = self._handed - kept if self._failure else 0
        return RecorderFigures(
            received=self._received,
            kept=kept,
            file_size=self._writer.size,
            queued=len(self._queue),
            queued_bytes=self._received_bytes - self._drained_bytes,
            lost=self._overflowed + unwritten,
            failure=self._failure,
        )

    def _take(self, item: _Item) -> None:
        self._received += 1
        size = len(item[1])
        if self._received_bytes - self._drained_bytes + size > self._memory_limit:
            self._overflowed += 1
            return
        self._received_bytes += size
        self._queue.append(item)

    def _settle(self) -> None:
        limit = time.monotonic() + _SETTLE_LIMIT
        before = -1
        while self._received != before and time.monotonic() < limit:
            before = self._received
            self._ending.wait(_QUIET_PERIOD)

    def _work(self) -> None:
        kept, changed = 0, time.monotonic()
        while not self._ending.wait(_DRAIN_PERIOD):
            self._guarded(self._write_queued)
            if self._writer.kept != kept or not self._writer.pending:
                kept, changed = self._writer.kept, time.monotonic()
            elif time.monotonic() - changed > _FLUSH_PERIOD:
                self._guarded(self._writer.flush)
        self._guarded(self._write_queued)

    def _write_queued(self) -> None:
        queue, write, watches, stamp_of = self._queue, self._writer.write, self.watches, self._stamp_of
        for _ in range(len(queue)):
            topic, raw, received, sent = queue.popleft()
            self._drained_bytes += len(raw)
            self._handed += 1
            write(topic, raw, received, sent)
            if topic in watches:
                watches[topic].add(stamp_of[topic](raw))

    def _discard_queued(self) -> None:
        for _ in range(len(self._queue)):
            self._drained_bytes += len(self._queue.popleft()[1])
            self._handed += 1

    def _guarded(self, step: Callable[[], None]) -> None:
        try:
            if not self._failure:
                step()
        except Exception as error:
            # The border of the thread: a recorder that ends without a word would be the worst of all.
            known = isinstance(error, RecordingError)
            self._failure = str(error) if known else f'recording stopped: {type(error).__name__}: {error}'
        if self._failure:
            self._discard_queued()
