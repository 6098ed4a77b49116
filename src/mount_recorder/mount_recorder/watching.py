"""Watches of what the recorder writes: the switching of damping, faults of nodes."""

import math
from collections.abc import Callable

from mount_recorder.automatic_marks import PAUSE, AutomaticMarks, MarkKind, of_mount
from mount_recorder.stamp_watch import StampWatch
from mount_ros.messages.scalars import ScalarsReader
from mount_ros.messages.verdicts import Level, verdicts_of


class SwitchWatch:
    """Marks where `damping_active` of `control_trace` leaves 0 after a pause that is long enough to be one.

    `stamps` counts the samples of the trace; `mount`: the one of several.
    """

    def __init__(self, marks: AutomaticMarks, stamps: StampWatch, mount: str = ''):
        self._marks, self._stamps, self._mount = marks, stamps, mount
        self._reader = ScalarsReader(('damping_active', 'magnitude'))
        self._damped: int | None = None  # stamp of the last step with damping on
        self.off = 0
        """Stamp of the first step without damping after it, ns."""

    def observe(self, raw: bytes) -> None:
        """Evaluate a serialised trace; its magnitude is the band displacement that decided, m, or NaN."""
        stamp, (active, magnitude) = self._reader.read(raw)
        self._stamps.add(stamp)
        if active > 0.0:
            if self._damped is None or not 0 <= stamp - self._damped <= PAUSE * 1e9:
                level = '' if math.isnan(magnitude) else f' at {1e3 * magnitude:.2f} mm in the band'
                self._marks.mark(MarkKind.SWITCH_ON, stamp, f'{of_mount(self._mount)}damping on{level}')
            self._damped = stamp
        elif self._damped is not None and self.off <= self._damped:
            self.off = stamp


class FaultWatch:
    """Marks where a node of `namespace` begins to report an error; `now` returns the time, ns."""

    def __init__(self, marks: AutomaticMarks, namespace: str, now: Callable[[], int]):
        self._marks = marks
        self._prefix = f'{namespace.strip("/")}/'.lstrip('/')
        self._now = now
        self._failing: set[str] = set()

    def observe(self, raw: bytes) -> None:
        """Evaluate a serialised `DiagnosticArray`."""
        for verdict in verdicts_of(raw):
            node = verdict.node
            if verdict.level != Level.ERROR:
                self._failing.discard(node)
            elif node.startswith(self._prefix) and node not in self._failing:
                self._failing.add(node)
                self._marks.mark(MarkKind.FAULT, self._now(), f'{node}: {verdict.sentence}')
