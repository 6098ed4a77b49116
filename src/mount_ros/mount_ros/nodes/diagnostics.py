"""The verdict of a node on `/diagnostics`: a level and a sentence, at 1 Hz and on each change.

A sentence stands still while what it tells of stands: a number in it is that of the detection, and what goes
on changing is a figure beside it. Else each look would publish.

A thread of its own judges ten times a second. By a timer of the node's executor each time would cost two
milliseconds of Python (measured), which the executor takes to find out what is ready.
"""

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Generic, NamedTuple, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS

WINDOW = 10.0
"""s, chosen: over it counts and shares that raise a warning are taken.

Long enough that whoever looks at `/diagnostics`, which are repeated each second, sees what lasted for a
moment; short enough that a warning tells of the present and not of the start.
"""
_PERIOD = 0.1  # s, chosen
_BEATS_TO_REPEAT = 10  # 1 Hz


Counted = TypeVar('Counted')


class Level(IntEnum):
    """Severity, with the numbers of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class Finding(NamedTuple):
    """Something that is not as it should be: value, limit and remedy in one sentence.

    By its `name` it is known again while it stands, whatever numbers a later sentence holds.
    """

    level: Level
    name: str
    sentence: str


@dataclass(frozen=True)
class Verdict:
    """A node's judgement of itself: level, one sentence, made of `findings` if any, and figures by name."""

    level: Level
    sentence: str
    figures: Mapping[str, object] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def verdict_on(findings: Iterable[Finding], well: str, figures: Mapping[str, object]) -> Verdict:
    """Return the verdict on `findings`, gravest first, or that all is `well`.

    The first error speaks alone; of warnings none hides another.
    """
    found = tuple(findings)
    level = max((each.level for each in found), default=Level.OK)
    sentences = [each.sentence for each in found if each.level is level]
    sentence = _joined(sentences if level is Level.WARN else sentences[:1])
    return Verdict(level, sentence or well, figures, found)


def _joined(sentences: Sequence[str]) -> str:
    return ' '.join(text if text.endswith('?') else f'{text}.' for text in sentences).removesuffix('.')


class ActiveFindings:
    """What was found and still stands, each in the words in which it was told first."""

    def __init__(self) -> None:
        self._told: dict[tuple[Level, str], Finding] = {}

    def keep(self, verdict: Verdict) -> Verdict:
        """Return `verdict` with the sentences told before for its findings; forget what stands no more."""
        before = self._told
        self._told = {each[:2]: before.get(each[:2], each) for each in verdict.findings}
        return verdict_on(self._told.values(), verdict.sentence, verdict.figures) if self._told else verdict


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


class Diagnostics:
    """Publishes the verdict of `judge` once a second, and at once when its level or sentence changes.

    From `start` to `stop`, but not while `pause` is held: what is judged is being changed then.
    """

    def __init__(self, node: Node, judge: Callable[[], Verdict]):
        self.pause = threading.RLock()
        self._node = node
        self._judge = judge
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        self._last: tuple[Level, str, object] | None = None
        self._beats = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='diagnostics', daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Return when it looks no more; safe to call twice."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def publish(self, verdict: Verdict) -> None:
        """Publish a verdict now."""
        namespace = self._node.get_namespace().rstrip('/')
        status = DiagnosticStatus(
            level=bytes([verdict.level]),
            name=f'{namespace}/{self._node.get_name()}'.lstrip('/'),
            message=verdict.sentence,
            hardware_id=namespace.lstrip('/') or 'engine_mount',
            values=[KeyValue(key=key, value=str(value)) for key, value in verdict.figures.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
        self._last = _essence(verdict)

    def _serve(self) -> None:
        while not self._ending.wait(_PERIOD):
            with self.pause:
                if self._ending.is_set():
                    return
                try:
                    self._beat()
                except Exception as error:
                    # The border of the thread; without a context nothing can be logged.
                    if not self._node.context.ok():
                        return
                    text = f'no diagnostics: {type(error).__name__}: {error}'
                    self._node.get_logger().error(text, throttle_duration_sec=1.0)

    def _beat(self) -> None:
        self._beats += 1
        verdict = self._judge()
        if self._beats % _BEATS_TO_REPEAT == 0 or _essence(verdict) != self._last:
            self.publish(verdict)


def _essence(verdict: Verdict) -> tuple[Level, str, object]:
    """Return what makes a verdict news."""
    return verdict.level, verdict.sentence, verdict.figures.get('unmatched')
