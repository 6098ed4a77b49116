"""What a node says of itself on `/diagnostics`: a level and a sentence, at 1 Hz and on each change."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS


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
    """Publishes the verdict of `judge` once a second, and at once when its level or sentence changes."""

    def __init__(self, node: Node, judge: Callable[[], Verdict]):
        self._node = node
        self._judge = judge
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        self._last: tuple[Level, str, object] | None = None
        self._beats = 0
        self._timer = node.create_timer(0.1, self._beat)

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

    def _beat(self) -> None:
        self._beats += 1
        verdict = self._judge()
        if self._beats % 10 == 0 or _essence(verdict) != self._last:
            self.publish(verdict)


def _essence(verdict: Verdict) -> tuple[Level, str, object]:
    """Return what makes a verdict news."""
    return verdict.level, verdict.sentence, verdict.figures.get('unmatched')
