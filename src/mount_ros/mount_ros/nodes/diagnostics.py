"""The verdict of a node on `/diagnostics`: a level and a sentence, at 1 Hz and on each change.

A thread of its own judges ten times a second. By a timer of the node's executor each time would cost two
milliseconds of Python (measured), which the executor takes to find out what is ready.
"""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS

_PERIOD = 0.1  # s, chosen
_BEATS_TO_REPEAT = 10  # 1 Hz


class Level(IntEnum):
    """Severity, with the numbers of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Verdict:
    """A node's judgement of itself: level, one sentence, and figures by name."""

    level: Level
    sentence: str
    figures: Mapping[str, object] = field(default_factory=dict)


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
