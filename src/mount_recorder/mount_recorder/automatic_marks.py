"""Marks that the recorder sets by itself: their kinds, and how many of each."""

import time
from collections.abc import Callable, Iterable
from enum import Enum

from mount_models.quantity import ParameterError
from mount_ros.messages.event import Mark

BURST = 10  # marks, chosen: so many of a kind in a row ...
REFILL = 2.0  # s, chosen: ... and then one in this time, so that a broken stream does not flood

PAUSE = 0.04
"""Seconds (chosen) for which damping must be off to count as switched off: damping that flutters about its
lowest degree is on. What switches by periods of 20 Hz or less is never off for less."""


class MarkKind(Enum):
    """What is marked without being asked; the value is the word in the mark."""

    SWITCH_ON = 'switch_on'
    FAULT = 'fault'
    RECORDING_LOSS = 'recording_loss'


class AutomaticMarks:
    """Hands marks of the wanted kinds to `send`, not more than a ration of each."""

    def __init__(
        self,
        send: Callable[[Mark], None],
        kinds: Iterable[MarkKind] = MarkKind,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.sent = 0
        self._send = send
        self._clock = clock
        self._rations = {kind: Ration(clock()) for kind in kinds}

    def mark(self, kind: MarkKind, stamp: int, text: str) -> None:
        """Mark what happened at `stamp` (ns), if that kind is wanted and its ration not used up."""
        withheld = self._rations[kind].take(self._clock()) if kind in self._rations else None
        if withheld is not None:
            self.sent += 1
            more = f'; {withheld} more since the mark before' if withheld else ''
            self._send(Mark(stamp, kind.value, text + more))


class Ration:
    """Lets `BURST` through at once and one more per `REFILL`; counts what it holds back."""

    def __init__(self, now: float):
        self._left = float(BURST)
        self._now = now
        self._withheld = 0

    def take(self, now: float) -> int | None:
        """Return how many were held back before this one, None if this one is held back too."""
        self._left = min(float(BURST), self._left + (now - self._now) / REFILL)
        self._now = now
        if self._left < 1.0:
            self._withheld += 1
            return None
        self._left -= 1.0
        withheld, self._withheld = self._withheld, 0
        return withheld


def mark_kinds(words: str) -> tuple[MarkKind, ...]:
    """Return the kinds of a list of words such as `switch_on, fault`; raises `ParameterError`."""
    try:
        return tuple(MarkKind(word) for word in words.replace(',', ' ').split())
    except ValueError:
        known = ', '.join(kind.value for kind in MarkKind)
        raise ParameterError(f'automatic_marks must be some of {known}; instead received {words!r}') from None


def of_mount(mount: str) -> str:
    """Return what stands before the text of a mark that concerns one of several mounts."""
    return f'{mount}: ' if mount else ''
