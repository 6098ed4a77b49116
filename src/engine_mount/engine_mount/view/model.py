"""The picture of a graph: takes messages from a feed, and once an interval makes of them what viewers get."""

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.layout import LayoutError
from engine_mount.recordings.mcap_records import HEAD
from engine_mount.recordings.series import Payloads, Series
from engine_mount.reports.drawing.chart import COLOUR_OF, Chart, Curve, Panel, level_lines, look_of
from engine_mount.reports.drawing.detail import browser_chart
from engine_mount.reports.drive.beside import MOUNTS, THIS, name_of
from engine_mount.reports.drive.signals import levels_of
from engine_mount.settings.chosen import Parameters, policy_of
from engine_mount.view.alternatives import Alternatives
from engine_mount.view.feed import Feed, Message, Receive
from engine_mount.view.state import GraphState
from mount_recorder.automatic_marks import PAUSE
from mount_ros.messages.event import Mark
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import (
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    JOINT_STATE,
    SIM_CHASSIS_ACCELERATION,
    Delivery,
    Scalar,
    Topic,
)
from mount_sim.plant.mounts import seat_of, without_friction

WINDOW = 60.0  # s: kept for who comes later
INTERVALS_PER_SECOND = 30
_HIGHEST_STATE_RATE = 100.0  # Hz: above it a topic is a trace, not a state

BESIDE = Topic(
    'beside', JOINT_STATE, Delivery.STREAM, 0.0, 'displacements of the other mounts',
    tuple(Scalar(name.replace(' ', '_'), 'm') for name in MOUNTS),
)  # fmt: skip
"""What a Foxglove server has beside the topics of the graph."""
_OF_FRICTION = ('damping', 'current', 'friction force')  # panels
_STILL = 3.0  # s, chosen: without a sample for so long a drive counts as ended

Array = NDArray[np.float64]
Extent = tuple[float, float]
"""The least and the highest value within an interval."""


class Trace(NamedTuple):
    """One line of a panel; `factor` turns the SI value of a column into the unit of the panel."""

    key: str
    label: str
    panel: str
    topic: Topic = DISPLACEMENT
    column: str = ''
    factor: float = 1.0


class Interval(NamedTuple):
    """One interval of the picture: number, time of its last sample (s), {key: extent in the shown unit}."""

    number: int
    time: float
    extents: dict[str, Extent]

    def as_json(self) -> list[Any]:
        """Return it with the digits that a picture shows."""
        extents = {key: [float(f'{value:.5g}') for value in pair] for key, pair in self.extents.items()}
        return [self.number, round(self.time, 4), extents]


TRACES = (
    Trace('displacement', THIS, 'displacement', DISPLACEMENT, 'mount', 1e3),
    Trace('damping', 'damping', 'damping', CONTROL_TRACE, 'damping_active'),
    Trace('setpoint', 'setpoint', 'current', CURRENT_SETPOINT, 'coil_current'),
    Trace('current', 'measured', 'current', COIL_RIPPLE, 'coil_current'),
    Trace('desired_force', 'wanted', 'friction force', CONTROL_TRACE, 'desired_force'),
)
_LATENCY = Trace('latency', 'sample to setpoint', 'latency')
PANELS: dict[str, tuple[str, float, tuple[float, ...]]] = {
    'displacement': ('mm', 1.2, ()),
    'damping': ('', 0.4, (0.0, 1.0)),
    'current': ('A', 0.7, (0.0,)),
    'friction force': ('N', 0.7, ()),
    'latency': ('ms', 0.5, (0.0,)),
}
"""{panel: (unit, share of the height, values that are always shown)}."""


class Model:
    """What is known of the graph that a feed shows; `on_interval` gets each new interval.

    An exception in its thread or in that of the feed ends the view: `failure` says which, and `on_failure` is
    called there.
    """

    def __init__(
        self,
        feed: Feed,
        *,
        beside: bool = True,
        receivers: Sequence[Receive] = (),
        on_failure: Callable[[], None] = lambda: None,
    ):
        self.failure = ''
        self.state = GraphState(namespace_of(feed), zero=feed.zero)
        self._receivers, self._beside_layout = receivers, ScalarsLayout(BESIDE)
        self._motion: dict[str, tuple[float, float, int]] = {}  # mm, mm^2 and samples by the mount
        self._damped: int | None = None  # stamp of the last sample with damping, until it is off
        self._sampled = time.monotonic()  # s, when the last samples came
        self.intervals: deque[Interval] = deque(maxlen=round(WINDOW * INTERVALS_PER_SECOND))
        self.alternatives: Alternatives | None = None
        self._beside = beside
        self._on_failure = on_failure
        self._arrived: deque[Message] = deque()
        self._made_with: Parameters = {}
        self._number, self._newest = 0, 0  # intervals, ns of arrival
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='view', daemon=True)
        self.on_interval: Callable[[Interval], None] = lambda interval: None
        """Called with each interval from the thread of the model."""
        if beside:
            Alternatives({}).advance([0], np.zeros(1))  # loads the compiled laws before anything comes

    def take(self, message: Message) -> None:
        """Take a message, for the receivers too; cheap, from any thread."""
        self._arrived.append(message)
        self._hand_on(message)

    def _hand_on(self, message: Message) -> None:
        for receive in self._receivers:
            receive(message)

    def start(self) -> None:
        """Begin to make intervals."""
        self._thread.start()

    def stop(self) -> None:
        """Return when no interval is made any more."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def fail(self, reason: str) -> None:
        """End the view: without a sentence the last picture would pass for the present one."""
        self.failure = self.failure or f'the view has ended: {reason}'
        self._on_failure()

    @property
    def traces(self) -> list[Trace]:
        """All lines in the order of their panels."""
        own = name_of(seat_of(self.state.parameters))
        beside = [Trace(f'beside.{name}', name, 'displacement') for name in MOUNTS if name != own]
        first = TRACES[0]._replace(label=own)
        return [*(beside if self.alternatives is not None else []), first, *TRACES[1:], _LATENCY]

    def chart(self) -> dict[str, Any]:
        """Return the panels for the page's script; the `key` of a curve is that of an interval's extents."""
        panels = []
        reason = self._without_friction
        for name, (unit, share, least) in PANELS.items():
            if reason and name in _OF_FRICTION:
                continue
            curves = []
            for label, key in ((trace.label, trace.key) for trace in self.traces if trace.panel == name):
                look = look_of(label, COLOUR_OF.get(key, ''))
                curves.append(Curve(label, np.empty(0), np.empty(0), *look, key=key))
            levels = level_lines(self._levels()) if name == 'displacement' else ()
            label = f'{name} ({unit})' if unit else name
            panels.append(Panel(label, curves, levels=levels, share=share, least=least))
        return browser_chart(Chart('view', 'view', 'time from the first sample (s)', panels))

    def state_json(self) -> dict[str, Any]:
        """Return the state: nodes, motion of the mounts, gap, coil, losses, events, whether it has ended."""
        found, still = self.state.as_json(self._newest), time.monotonic() - self._sampled
        motion = [
            {'name': f'{name}: peak, rms', 'value': f'{peak:.2f}, {math.sqrt(squares / count):.3f} mm'}
            for name, (peak, squares, count) in reversed(list(self._motion.items()))
        ]
        end = f'ended: no sample for {still:.0f} s' if still > _STILL else ''
        return {**found, 'values': motion + found['values'], 'end': end}

    def interval(self, messages: list[Message]) -> Interval:
        """Make an interval of what has arrived since the last one, and keep it if it shows anything."""
        by_topic: dict[Topic, list[Message]] = {}
        for message in messages:
            by_topic.setdefault(message.topic, []).append(message)
            if message.topic.rate <= _HIGHEST_STATE_RATE:
                with contextlib.suppress(LayoutError, RuntimeError):  # of bytes that are no such message
                    self.state.take(message)
            self._newest = message.received
        series = {topic: _series(topic, found) for topic, found in by_topic.items()}
        found = {trace.key: _column(series, trace.topic, trace.column) * trace.factor for trace in TRACES}
        found[_LATENCY.key] = 1e3 * _latencies(series)
        found |= {f'beside.{name}': 1e3 * moved for name, moved in self._moved_beside(series).items()}
        if DISPLACEMENT in series and (stamps := series[DISPLACEMENT].stamps).size:
            zero = self.state.zero = int(stamps[0]) if self.state.zero is None else self.state.zero
            self.state.time = (int(stamps[-1]) - zero) * 1e-9
            self._sampled = time.monotonic()
        self._watch_damping(series)
        known = {key: values[np.isfinite(values)] for key, values in found.items()}
        extents = {key: (float(v.min()), float(v.max())) for key, v in known.items() if v.size}
        for trace in self.traces:
            if trace.panel == 'displacement' and trace.key in extents:
                moved = np.abs(known[trace.key])
                peak, squares, count = self._motion.get(trace.label, (0.0, 0.0, 0))
                squares += float(np.sum(moved * moved))
                self._motion[trace.label] = max(peak, float(moved.max())), squares, count + len(moved)
        self._number += bool(extents)  # an empty one is no gap in a line
        interval = Interval(self._number, self.state.time, extents)
        if extents:
            self.intervals.append(interval)
        return interval

    def _watch_damping(self, series: Mapping[Topic, Series]) -> None:
        degrees = _column(series, CONTROL_TRACE, 'damping_active')
        if not len(degrees) or self._without_friction:
            return
        for stamp, degree in zip(series[CONTROL_TRACE].stamps.tolist(), degrees.tolist(), strict=True):
            if degree > 0.0:
                if self._damped is None:
                    self.state.add(Mark(stamp, 'damping', 'on'), 0)
                self._damped = stamp
            elif self._damped is not None and stamp - self._damped > PAUSE * 1e9:
                self.state.add(Mark(self._damped, 'damping', 'off'), 0)
                self._damped = None

    @property
    def _without_friction(self) -> str:
        return without_friction(seat_of(self.state.parameters))

    def _levels(self) -> Mapping[str, float]:
        try:
            return {} if self._without_friction else levels_of(*policy_of(self.state.parameters))
        except ValueError:
            return {}

    def _serve(self) -> None:
        try:
            due = time.monotonic()
            while not self._ending.is_set():
                due += 1.0 / INTERVALS_PER_SECOND
                self._ending.wait(max(0.0, due - time.monotonic()))
                count = len(self._arrived)
                self.on_interval(self.interval([self._arrived.popleft() for _ in range(count)]))
        except Exception as error:
            self.fail(f'{type(error).__name__}: {error}')

    def _moved_beside(self, series: Mapping[Topic, Series]) -> Mapping[str, Array]:
        """Return displacements (m) of the alternatives, made anew where the parameters are others."""
        if not self._beside or SIM_CHASSIS_ACCELERATION not in series:
            return {}
        if self.alternatives is None or self._made_with != self.state.parameters:
            self._made_with = self.state.parameters
            try:
                self.alternatives = Alternatives(self.state.parameters)
            except ValueError:  # parameters of another version
                self._beside, self.alternatives = False, None
                return {}
        accelerations = _column(series, SIM_CHASSIS_ACCELERATION, 'linear_acceleration.z')
        shaken = series[SIM_CHASSIS_ACCELERATION]
        stamps = shaken.stamps.tolist()
        moved = self.alternatives.advance(stamps[: len(accelerations)], accelerations)
        columns = shaken.receive_times.tolist(), stamps, *(each.tolist() for each in moved.values())
        for received, stamp, *row in zip(*columns, strict=False):
            self._hand_on(Message(BESIDE, self._beside_layout.pack(stamp, row), received, stamp))
        return moved


def namespace_of(feed: Feed) -> str:
    """Return the namespace of the mount of a feed, empty for the root."""
    space = next((name for name, topic in feed.topics.items() if topic is DISPLACEMENT), '')
    return space.removesuffix(f'/{DISPLACEMENT.name}')


def _series(topic: Topic, messages: Iterable[Message]) -> Series:
    raw = [message.raw for message in messages]
    piece: NDArray[np.uint8] | list[bytes] = raw
    if len({*map(len, raw)}) == 1:
        piece = np.frombuffer(b''.join(raw), np.uint8).reshape(len(raw), -1)
    heads = np.zeros(len(raw), HEAD)
    heads['log_time'] = [message.received for message in messages]
    heads['publish_time'] = [message.sent for message in messages]
    return Series(topic.name, topic.type, (Payloads([piece]), heads))


def _column(series: Mapping[Topic, Series], topic: Topic, name: str) -> Array:
    """Return a column in SI, empty where the topic has no message or its messages lack it."""
    try:
        return np.asarray(series[topic][name], float)
    except (KeyError, ValueError):
        return np.empty(0)


def _latencies(series: Mapping[Topic, Series]) -> Array:
    """Return the times (s) from when a sample was published to when its answer was."""
    try:
        samples, answers = series[DISPLACEMENT], series[CURRENT_SETPOINT]
        _, first, second = np.intersect1d(samples.stamps, answers.stamps, return_indices=True)
    except (KeyError, ValueError):
        return np.empty(0)
    return (answers.publish_times[second] - samples.publish_times[first]) * 1e-9
