"""The last messages, kept in memory, with which a recording around an event begins."""

import math
import time
from collections import deque
from collections.abc import Callable

Item = tuple[str, bytes, int, int]
"""Topic, message, times of arrival and of sending in ns."""

ITEM_OVERHEAD = 288
"""Bytes of memory per message besides its payload: tuples, numbers, head of the bytes (measured: 272)."""


class EventWindow:
    """Selects the messages from `before` s before to `after` s after each message of the topic `trigger`.

    What comes before an event is bounded by `memory` bytes too. Times are those of the steady `clock`: the
    system's may step.
    """

    def __init__(
        self,
        trigger: str,
        before: float,
        after: float,
        memory: int,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.latched: set[str] = set()
        """The topics of which a recording has the last message, however old."""
        self.held_bytes = 0
        """What lies in memory, estimated from above."""
        self._trigger, self._before, self._after, self._memory = trigger, before, after, memory
        self._clock = clock
        self._held: deque[tuple[float, Item]] = deque()
        self._last: dict[str, Item] = {}  # of each topic, of those that have left the memory
        self._until = -math.inf

    @property
    def running(self) -> bool:
        """Whether messages are recorded at present."""
        return self._clock() <= self._until

    @property
    def held(self) -> float:
        """How many seconds lie in memory."""
        return self._held[-1][0] - self._held[0][0] if self._held else 0.0

    def add(self, item: Item) -> tuple[bool, list[Item]]:
        """Take a message; return whether a recording begins with it, and what it shall write."""
        now = self._clock()
        self._hold(now, item)
        waiting = now > self._until
        if item[0] == self._trigger:
            self._until = now + self._after
            return waiting, self._contents() if waiting else [item]
        return False, [] if waiting else [item]

    def _hold(self, now: float, item: Item) -> None:
        held = self._held
        held.append((now, item))
        self.held_bytes += len(item[1]) + ITEM_OVERHEAD
        while held[0][0] < now - self._before or (self.held_bytes > self._memory and len(held) > 1):
            _, left = held.popleft()
            self.held_bytes -= len(left[1]) + ITEM_OVERHEAD
            self._last[left[0]] = left

    def _contents(self) -> list[Item]:
        """Return the latched messages, as of the begin of the window, and all that lie in memory."""
        begin = self._held[0][1][2]
        latched = [self._last[topic] for topic in sorted(self.latched & self._last.keys())]
        return [(topic, raw, begin, sent) for topic, raw, _, sent in latched] + [
            item for _, item in self._held
        ]
