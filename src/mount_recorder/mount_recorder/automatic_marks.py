"""Marks that the recorder sets by itself, from the streams that it sees."""

import math
import time
from collections.abc import Callable, Iterable
from enum import Enum

from mount_recorder.stamp_watch import StampWatch
from mount_ros.messages.event import Mark
from mount_ros.messages.verdicts import ToldVerdict

BURST = 10  # marks, chosen: so many of a kind in a row ...
REFILL = 2.0  # s, chosen: ... and then one in this time, so that a broken stream does not flood

PAUSE = 0.04
"""Seconds (chosen) for which damping must be off to count as switched off: an opening that flutters about its
smallest is one. What switches by periods of 20 Hz or less is never off for less."""

_ERROR = 2  # diagnostic_msgs/DiagnosticStatus.ERROR

Send = Callable[[Mark], None]


class MarkKind(Enum):
    """What is marked without being asked; the value is the word in the mark."""

    SWITCH_ON = 'switch_on'
    FAULT = 'fault'
    LOST_SAMPLE = 'lost_sample'
    UNANSWERED = 'unanswered'
    RECORDING_LOSS = 'recording_loss'


class AutomaticMarksError(ValueError):
    """A kind of mark is unknown; the text says which there are."""


class AutomaticMarks:
    """Hands marks of the wanted kinds to `send`, not more than a ration of each."""

    def __init__(
        self, send: Send, kinds: Iterable[MarkKind] = MarkKind, clock: Callable[[], float] = time.monotonic
    ):
        self.sent = 0
        self._send = send
        self._clock = clock
        self._rations = {kind: Ration(clock()) for kind in kinds}

    def mark(self, kind: MarkKind, stamp: int, text: str) -> None:
        """Mark what happened at `stamp` (ns), if that kind is wanted and its ration not used up."""
        ration = self._rations.get(kind)
        if ration is None:
            return
        withheld = ration.take(self._clock())
        if withheld is None:
            return
        if withheld:
            text = f'{text}; {withheld} more since the mark before'
        self.sent += 1
        self._send(Mark(stamp, kind.value, text))


def of_mount(mount: str) -> str:
    """Return what stands before the text of a mark that concerns one of several mounts."""
    return f'{mount}: ' if mount else ''


class SwitchOnWatch:
    """Marks where `damping_active` leaves 0 after a pause that is long enough to be one.

    `mount`: which of several, empty where there is one.
    """

    def __init__(self, marks: AutomaticMarks, mount: str = ''):
        self._marks = marks
        self._of = of_mount(mount)
        self._last: int | None = None  # stamp of the last step with damping on

    def add(self, stamp: int, active: float, magnitude: float) -> None:
        """Take one control step; `magnitude` is the band displacement that decided, m, NaN where none did."""
        if not active > 0.0:
            return
        if self._last is None or not 0 <= stamp - self._last <= PAUSE * 1e9:
            level = '' if math.isnan(magnitude) else f' at {1e3 * magnitude:.2f} mm in the band'
            self._marks.mark(MarkKind.SWITCH_ON, stamp, f'{self._of}damping on{level}')
        self._last = stamp


class FaultWatch:
    """Marks where a node of `namespace` begins to report an error."""

    def __init__(self, marks: AutomaticMarks, namespace: str):
        self._marks = marks
        self._prefix = f'{namespace.strip("/")}/'.lstrip('/')
        self._failing: set[str] = set()

    def add(self, stamp: int, told: ToldVerdict) -> None:
        """Take the verdict of one node, seen at `stamp` (ns)."""
        if not told.node.startswith(self._prefix):
            return
        if told.level != _ERROR:
            self._failing.discard(told.node)
        elif told.node not in self._failing:
            self._failing.add(told.node)
            self._marks.mark(MarkKind.FAULT, stamp, f'{told.node}: {told.sentence}')


class LostSampleWatch:
    """Counts the samples of a topic and marks where some are missing.

    Of the control's own trace (kind `UNANSWERED`) they were never sent: control did not answer.
    """

    def __init__(
        self, marks: AutomaticMarks, topic: str, watch: StampWatch, kind: MarkKind = MarkKind.LOST_SAMPLE
    ):
        self._marks = marks
        self._topic = topic
        self._watch = watch
        self._kind = kind
        self._what = 'missing' if kind is MarkKind.LOST_SAMPLE else 'without a control step'

    def add(self, stamp: int) -> None:
        """Take the sample of time `stamp` (ns)."""
        watch = self._watch
        before = watch.lost
        watch.add(stamp)
        if watch.lost > before:
            count = watch.lost - before
            noun = 'sample' if count == 1 else 'samples'
            self._marks.mark(self._kind, stamp, f'{self._topic}: {count} {noun} {self._what}')


def mark_kinds(words: str) -> tuple[MarkKind, ...]:
    """Return the kinds of a list of words such as `switch_on, fault`; raises `AutomaticMarksError`."""
    try:
        return tuple(MarkKind(word) for word in words.replace(',', ' ').split())
    except ValueError:
        known = ', '.join(kind.value for kind in MarkKind)
        raise AutomaticMarksError(
            f'automatic_marks must be some of {known}; instead received {words!r}'
        ) from None


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
