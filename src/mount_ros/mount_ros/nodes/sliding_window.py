"""What was counted lately: a warning is raised by the last seconds, not by all that has ever been."""

import math
import threading
from collections import deque
from typing import Generic, TypeVar

WINDOW = 10.0
"""s, chosen: over it counts and shares that raise a warning are taken.

Long enough that whoever looks at `/diagnostics`, which are repeated each second, sees what lasted for a
moment; short enough that a warning tells of the present and not of the start.
"""

Counted = TypeVar('Counted')


class SlidingWindow(Generic[Counted]):
    """Keeps what had been counted at each look of the last `duration` s; any thread may ask.

    `initial` is what had been counted when counting began.
    """

    def __init__(self, initial: Counted, duration: float = WINDOW):
        self._duration = duration
        self._looks: deque[tuple[float, Counted]] = deque([(-math.inf, initial)])
        self._guard = threading.Lock()

    def earlier(self, now: float, counted: Counted) -> Counted:
        """Note what is counted `now` (s, steady clock); return what was a window ago, or in the beginning."""
        with self._guard:
            looks = self._looks
            looks.append((now, counted))
            while len(looks) > 1 and now - looks[1][0] >= self._duration:
                looks.popleft()
            return looks[0][1]
