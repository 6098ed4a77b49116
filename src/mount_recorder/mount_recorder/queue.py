"""What was received and is not yet written: a queue with a limit in bytes, and the counts of what came.

One thread puts messages in and one takes them out. Each number is changed by one of them alone, so that
neither waits for the other.
"""

from collections import deque
from collections.abc import Callable

from mount_recorder.statement import Reception

Item = tuple[str, bytes, int, int]
"""Topic, message, times of arrival and of sending in ns."""

ITEM_OVERHEAD = 256
"""Bytes of memory per message besides its payload: tuple, numbers, head of the bytes (measured: 203)."""


class ReceivedQueue:
    """Messages in the order in which they came; one for which `memory_limit` leaves no room is lost.

    The limit, in bytes, holds for the memory that they take, not for their payload alone.
    """

    def __init__(self, memory_limit: int):
        self.receptions: dict[str, Reception] = {}
        """What came on each topic, and how much of it had no room."""
        self._items: deque[Item] = deque()
        self._memory_limit = memory_limit
        self._received_bytes = 0  # changed by the receiving thread alone
        self._drained_bytes = 0  # changed where the writing is done alone
        self.pop = self._items.popleft
        """Takes the oldest message out; its room stays taken until `free`."""

    def __len__(self) -> int:
        return len(self._items)

    @property
    def size(self) -> int:
        """How many bytes of memory are taken."""
        return self._received_bytes - self._drained_bytes

    @property
    def received(self) -> int:
        """How many messages came."""
        return sum(entry.received for entry in self.receptions.values())

    @property
    def overflowed(self) -> int:
        """How many of them had no room."""
        return sum(entry.overflowed for entry in self.receptions.values())

    @property
    def newest_arrival(self) -> int:
        """When the newest message in the queue arrived, ns; 0 if the queue is empty."""
        try:
            return self._items[-1][2]
        except IndexError:  # the writing thread was faster
            return 0

    def taker(self, topic: str) -> Callable[[Item], None]:
        """Return the function that puts in messages of `topic`; the receiving thread calls it."""
        reception = self.reception(topic)
        append = self._items.append

        def take(item: Item) -> None:
            reception.received += 1
            size = len(item[1]) + ITEM_OVERHEAD
            if self._received_bytes + size - self._drained_bytes > self._memory_limit:
                reception.overflowed += 1
                return
            self._received_bytes += size
            append(item)

        return take

    def reception(self, topic: str) -> Reception:
        """Return the counts of `topic`."""
        return self.receptions.setdefault(topic, Reception())

    def free(self, count: int, payload: int) -> None:
        """Give free the room of `count` messages that were taken out, with so many bytes of payload."""
        self._drained_bytes += payload + count * ITEM_OVERHEAD

    def discard(self) -> int:
        """Throw away what is in the queue; return how many messages."""
        count = len(self)
        for _ in range(count):
            self.free(1, len(self.pop()[1]))
        return count
