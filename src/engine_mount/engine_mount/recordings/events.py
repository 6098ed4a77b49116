"""What happened in a recording: marks, the switching of damping, and what the nodes said of themselves."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.difference import few, quantity_text, time_text
from engine_mount.recordings.metadata import registered_topic
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.times import TimeAxis
from mount_recorder.automatic_marks import PAUSE
from mount_ros.messages.event import Mark, read_mark
from mount_ros.messages.verdicts import NodeVerdict, verdicts_in
from mount_ros.topics import CONTROL_TRACE, DIAGNOSTICS, EVENT

Signal = NDArray[np.float64]
Places = NDArray[np.intp]

SWITCH_ON, SWITCH_OFF = 'switch_on', 'switch_off'
CONTROL = 'mount_control'  # the node
_ACTIVE = 'damping_active'
_LISTED = 12  # events in a refusal
_REACH = 0.5  # s, chosen: switchings further apart are not the same one moved
_ERROR = 2  # diagnostic_msgs/DiagnosticStatus.ERROR


class EventError(ValueError):
    """An event that was asked for is not in the recording; the text lists those that are."""


class RecordedEvent(NamedTuple):
    """Something worth finding again: when it was logged, and its time on the clock of the stamps, in ns."""

    log_time: int
    stamp: int
    kind: str
    text: str = ''


def recorded_events(recording: Recording) -> list[RecordedEvent]:
    """Return the events in `recording` in the order of their log times.

    They are the marks of the topics `event`, and where these tell of no `switch_on` or no `switch_off`, the
    changes of `damping_active` in the control trace.
    """
    marked = [
        RecordedEvent(log_time, mark.time, mark.kind, mark.text)
        for marks in recorded_marks(recording).values()
        for log_time, mark in marks
    ]
    unmarked = {SWITCH_ON, SWITCH_OFF} - {event.kind for event in marked}
    derived = [event for event in _switching(recording) if event.kind in unmarked] if unmarked else []
    return sorted([*marked, *derived], key=lambda event: event.log_time)


def recorded_marks(recording: Recording) -> dict[str, list[tuple[int, Mark]]]:
    """Return the marks by topic, for each mount has its own `event`; each with its log time (ns)."""
    return {
        name: list(zip(recording[name].receive_times.tolist(), read_marks(recording[name]), strict=True))
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is EVENT
    }


def read_marks(events: Series) -> list[Mark]:
    """Return the marks of a recording in the order in which they were set, from `recording['event']`."""
    messages = zip(events.messages(), events.receive_times.tolist(), strict=True)
    return [read_mark(message.data, received) for message, received in messages]


def find_event(recording: Recording, wanted: str) -> RecordedEvent:
    """Return the event meant by `wanted`: its number from 1, or its kind (the first one).

    In a kind `-` is as good as `_`. Raises `EventError` with the events that there are.
    """
    events = recorded_events(recording)
    for number, event in enumerate(events, 1):
        if wanted.replace('_', '-') in (str(number), event.kind.replace('_', '-')):
            return event
    raise EventError(f'{recording.path} has no event {wanted!r}; {_listed(recording, events)}')


def event_time(event: RecordedEvent, axis: TimeAxis) -> float:
    """Return when an event happened, in s on the time axis of its recording."""
    return axis.of_mark(event.stamp, event.log_time)


def _switching(recording: Recording) -> list[RecordedEvent]:
    if CONTROL_TRACE.name not in recording:
        return []
    try:
        recording.load_columns({CONTROL_TRACE.name: (_ACTIVE,)})
        trace = recording[CONTROL_TRACE.name]
        stamps, received, active = trace.stamps, trace.receive_times, trace[_ACTIVE]
    except SeriesError:
        return []  # no control trace of ours
    order = np.argsort(received, kind='stable')
    if not len(order):
        return []
    switched = switching_places((stamps[order] - stamps[order[0]]) / 1e9, active[order])
    return [
        RecordedEvent(int(received[place]), int(stamps[place]), kind)
        for kind, places in zip((SWITCH_ON, SWITCH_OFF), switched, strict=True)
        for place in order[places].tolist()
    ]


def _listed(recording: Recording, events: list[RecordedEvent]) -> str:
    if not events:
        return 'it has none, and damping was never switched; cut by --from and --to'
    axis = recording.time_axis
    texts = [
        f'{number} {event.kind} at {event_time(event, axis):.3f} s' for number, event in enumerate(events, 1)
    ]
    return f'it has {few(texts, most=_LISTED)}'


# Switching.


class Switching(NamedTuple):
    """When damping went on and off, s."""

    on: Sequence[float]
    off: Sequence[float]

    def sentence(self, digits: int = 3) -> str:
        """Return the first stretches in words, times with so many digits behind the point."""
        if not self.on:
            return 'never on'
        ends = (next((f'{off:.{digits}f} s' for off in self.off if off > on), 'the end') for on in self.on)
        return (
            f'on from {few([f"{on:.{digits}f} s to {end}" for on, end in zip(self.on, ends, strict=True)])}'
        )


class SwitchingChange(NamedTuple):
    """One switching: `on` or off, its times (s) in A and B, None where there is none, and of which mount."""

    on: bool
    time_a: float | None
    time_b: float | None
    mount: str = ''  # or such as `mount_left/`

    @property
    def moved(self) -> float:
        """By how much it is later in B, s; 0 where it is in one recording alone."""
        return 0.0 if self.time_a is None or self.time_b is None else self.time_b - self.time_a

    @property
    def alone(self) -> bool:
        """Whether it appeared or vanished."""
        return self.time_a is None or self.time_b is None

    @property
    def time(self) -> float:
        """Its time in A, or in B where A has none, s."""
        return self.time_a if self.time_a is not None else float(self.time_b or 0.0)

    def sentence(self, a: str = 'A', b: str = 'B') -> str:
        """Return the change in words; `a` and `b` name the recordings."""
        word, mount = 'on' if self.on else 'off', self.mount.replace('/', ': ')
        if self.time_b is None:
            return f'{mount}damping is not switched {word} in {b}, in {a} it is at {time_text(self.time)}'
        if self.time_a is None:
            return f'{mount}damping is switched {word} at {time_text(self.time_b)} in {b}, in {a} it is not'
        direction = 'later' if self.moved > 0.0 else 'earlier'
        by = quantity_text(abs(self.moved), 's')
        return f'{mount}switched {word} {by} {direction} in {b}, at {time_text(self.time_b)}'

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            'mount': self.mount.rstrip('/'),
            'kind': 'on' if self.on else 'off',
            'time_a_s': self.time_a,
            'time_b_s': self.time_b,
            'moved_ms': None if self.alone else round(1e3 * self.moved, 6),
        }


def switching_times(time: Signal, active: Signal) -> tuple[Signal, Signal]:
    """Return when damping went on and off; active at the first sample counts as switched on there."""
    on, off = switching_places(time, active)
    return time[on], time[off]


def switching_places(time: Signal, active: Signal) -> tuple[Places, Places]:
    """Return at which samples damping went on and off: where it is active, to any degree.

    So it counts as on where the coil carries current. A pause shorter than `PAUSE` is none.
    """
    is_active = active > 0.0
    changes = np.flatnonzero(is_active != np.append(False, is_active)[: len(is_active)])
    on, off = changes[::2], changes[1::2]
    pauses = time[on[1:]] - time[off[: len(on) - 1]] >= PAUSE if len(on) else np.zeros(0, bool)
    return on[np.append(True, pauses)[: len(on)]], off[np.append(pauses, True)[: len(off)]]


def paired_switchings(
    a: tuple[Signal, Signal], b: tuple[Signal, Signal], least: float, mount: str = ''
) -> list[SwitchingChange]:
    """Return all switchings of both recordings (on, off) in the order of time.

    In the order of time each is paired with the next of its kind within 0.5 s. `least` (s) is the period of
    the samples, below half of which nothing moves.
    """
    found = []
    for on, one, other in ((True, a[0].tolist(), b[0].tolist()), (False, a[1].tolist(), b[1].tolist())):
        while one or other:
            apart = other[0] - one[0] if one and other else np.inf if one else -np.inf
            time_a = one.pop(0) if apart >= -_REACH else None
            time_b = other.pop(0) if apart <= _REACH else None
            found.append(SwitchingChange(on, time_a, time_a if abs(apart) < 0.5 * least else time_b, mount))
    return sorted(found, key=lambda change: change.time)


# Reports of the nodes.


class NodeReport(NamedTuple):
    """One status: when it was logged (ns), of which node below which namespace, and what it said."""

    log_time: int
    namespace: str  # without slashes at its ends
    node: str
    level: int
    sentence: str
    state: str  # `active`, `inactive`, or empty where it did not say

    @property
    def is_error(self) -> bool:
        """Whether the node reported an error."""
        return self.level == _ERROR


def node_reports(recording: Recording) -> list[NodeReport]:
    """Return all reports in the order of their log times, none where they cannot be read."""
    if DIAGNOSTICS.name not in recording:
        return []
    try:
        if recording.topics[recording.resolve(DIAGNOSTICS.name)].type != DIAGNOSTICS.type:
            return []
        reports = [
            _report(time, verdict)
            for series in recording.parts([DIAGNOSTICS.name])
            for time, message in zip(series.receive_times.tolist(), series.messages(), strict=True)
            for verdict in verdicts_in(message)
        ]
    except ReadingError:
        return []
    return sorted(reports, key=lambda report: report.log_time)


def _report(log_time: int, verdict: NodeVerdict) -> NodeReport:
    namespace, _, node = verdict.node.rpartition('/')
    state = verdict.figures.get('state', '')
    return NodeReport(log_time, namespace.strip('/'), node, verdict.level, verdict.sentence, state)
