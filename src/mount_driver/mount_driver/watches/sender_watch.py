"""Whether a message has one sender only, by what its receiver has counted (`E2EReceiver.strangers`).

No bus and no clock here: times are ns by the clock that judges ages. Both ends of the bus run this code.
"""

from collections import deque
from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity


class SenderLimits(NamedTuple):
    """From when on frames that one sender alone cannot have sent mean that there is a second one."""

    limit: Annotated[
        int, Quantity('1', 'so many frames of a second sender take the coil to 0 A', 1, 100, 'chosen')
    ] = 3
    window: Annotated[float, Quantity('s', 'when they come within this time', 0.1, 3600.0, 'chosen')] = 10.0


class SenderWatch:
    """Watches the sender of one message."""

    def __init__(self, limits: SenderLimits, message: str, remedy: str):
        self._limits = limits
        self._message, self._remedy = message, remedy
        self._window = round(1e9 * limits.window)
        self._counted = 0
        self._times: deque[int] = deque(maxlen=limits.limit)
        self.last: int | None = None
        """Time of the last frame of a second sender; None before the first."""

    def judge(self, strangers: int, now: int) -> str:
        """Take the number of such frames so far; return why the coil is to be off, empty if it is not."""
        if strangers == self._counted:
            return ''
        self._times.extend([now] * min(strangers - self._counted, self._limits.limit))
        self._counted, self.last = strangers, now
        if len(self._times) < self._limits.limit or now - self._times[0] > self._window:
            return ''
        return (
            f'{len(self._times)} frames {self._message} within {self._limits.window:g} s (limit '
            f'{self._limits.limit}) had a counter or content that does not go on with the others: '
            f'a second sender is on the bus, or old frames are sent again; {self._remedy}'
        )
