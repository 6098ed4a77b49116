"""Watches of what the recorder writes: missing samples, the switching of damping, faults of nodes."""

import math
from collections.abc import Callable

from mount_recorder.automatic_marks import PAUSE, AutomaticMarks, MarkKind, of_mount
from mount_recorder.stamp_watch import StampWatch
from mount_ros.messages.scalars import ScalarsReader, stamp_of
from mount_ros.messages.verdicts import Level, verdicts_of


class SampleWatch:
    """Counts the samples of a topic of fixed rate and marks where some are missing.

    Of `control_trace` those were never sent, as control did not answer; there it also marks where
    `damping_active` leaves 0 after a pause that is long enough to be one. `mount`: the one of several.
    """

    def __init__(self, marks: AutomaticMarks, topic: str, rate: float, *, trace: bool, mount: str = ''):
        self.stamps = StampWatch(rate)
        self._marks = marks
        self._topic = topic
        self._mount = mount
        self._kind, self._absence = (
            (MarkKind.UNANSWERED, 'without a control step') if trace else (MarkKind.LOST_SAMPLE, 'missing')
        )
        self._reader = ScalarsReader(('damping_active', 'magnitude')) if trace else None
        self._damped: int | None = None  # stamp of the last step with damping on

    def observe(self, raw: bytes) -> None:
        """Evaluate a serialised sample."""
        if self._reader is None:
            self._add(stamp_of(raw))
        else:
            stamp, (active, magnitude) = self._reader.read(raw)
            self._add(stamp)
            if active > 0.0:
                self._add_damped(stamp, magnitude)

    def _add(self, stamp: int) -> None:
        before = self.stamps.lost
        self.stamps.add(stamp)
        if (count := self.stamps.lost - before) > 0:
            noun = 'sample' if count == 1 else 'samples'
            self._marks.mark(self._kind, stamp, f'{self._topic}: {count} {noun} {self._absence}')

    def _add_damped(self, stamp: int, magnitude: float) -> None:
        """Take a step with damping on; `magnitude` is the band displacement that decided, m, NaN for none."""
        if self._damped is None or not 0 <= stamp - self._damped <= PAUSE * 1e9:
            level = '' if math.isnan(magnitude) else f' at {1e3 * magnitude:.2f} mm in the band'
            self._marks.mark(MarkKind.SWITCH_ON, stamp, f'{of_mount(self._mount)}damping on{level}')
        self._damped = stamp


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
