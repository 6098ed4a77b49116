"""The verdict of a node on `/diagnostics`: a level and a sentence, at 1 Hz and on each change.

A sentence stands still while its finding stands: a number in it is that of the detection, and what goes
on changing is a figure beside it. Else each judgement would publish.
"""

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from mount_ros.messages.verdicts import Level
from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS

WINDOW = 10.0
"""s, chosen: over it counts and shares that raise a warning are taken.

Long enough that an observer of `/diagnostics`, which are repeated each second, sees what lasted for a
moment; short enough that a warning reports the present and not the start.
"""

_PERIOD = 0.1  # s, chosen
_PERIODS_TO_REPEAT = 10  # 1 Hz

Counted = TypeVar('Counted')


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

    Of errors the first stands alone; of warnings none hides another.
    """
    found = tuple(findings)
    level = max((each.level for each in found), default=Level.OK)
    sentences = [each.sentence for each in found if each.level is level]
    if level is not Level.WARN:
        return Verdict(level, sentences[0] if sentences else well, figures, found)
    whole = ' '.join(text if text.endswith('?') else f'{text}.' for text in sentences)
    return Verdict(level, whole.removesuffix('.'), figures, found)


class ActiveFindings:
    """The findings that still stand, each in its first words."""

    def __init__(self) -> None:
        self._first: dict[tuple[Level, str], Finding] = {}

    def keep(self, verdict: Verdict) -> Verdict:
        """Return `verdict` with the first sentences of its findings; forget those that stand no more."""
        before = self._first
        self._first = {each[:2]: before.get(each[:2], each) for each in verdict.findings}
        return verdict_on(self._first.values(), verdict.sentence, verdict.figures) if self._first else verdict


class SlidingWindow(Generic[Counted]):
    """Keeps what had been counted at each look of the last `duration` s; for any thread.

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

    From `start` to `stop`, but not while `pause` is held: what is judged is being changed then. A thread of
    its own judges ten times a second. By a timer of the node's executor each time would cost two milliseconds
    of Python (measured), in which the executor finds out what is ready.
    """

    def __init__(self, node: Node, judge: Callable[[], Verdict]):
        self.pause = threading.RLock()
        self._node = node
        self._judge = judge
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        self._last: tuple[Level, str, object] | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='diagnostics', daemon=True)

    def start(self) -> None:
        """Begin to judge."""
        self._thread.start()

    def stop(self) -> None:
        """Return when nothing is judged any more; safe to call twice."""
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
        self._last = _news(verdict)

    def _serve(self) -> None:
        periods = 0
        while not self._ending.wait(_PERIOD):
            periods += 1
            with self.pause:
                if self._ending.is_set():
                    return
                try:
                    verdict = self._judge()
                    if periods % _PERIODS_TO_REPEAT == 0 or _news(verdict) != self._last:
                        self.publish(verdict)
                except Exception as error:
                    # The border of the thread; without a context nothing can be logged.
                    if not self._node.context.ok():
                        return
                    text = f'no diagnostics: {type(error).__name__}: {error}'
                    self._node.get_logger().error(text, throttle_duration_sec=1.0)


def _news(verdict: Verdict) -> tuple[Level, str, object]:
    """Return what makes a verdict news."""
    return verdict.level, verdict.sentence, verdict.figures.get('unmatched')
