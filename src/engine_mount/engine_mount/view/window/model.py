"""The whole picture: takes messages from a feed, and once an interval makes of them what viewers get."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.layout import LayoutError
from engine_mount.reports.drive.evaluation import levels_of
from engine_mount.settings.chosen import policy_of
from engine_mount.view.beside.alternatives import Beside
from engine_mount.view.feed.feed import Feed, Message
from engine_mount.view.window.state import GraphState
from engine_mount.view.window.traces import (
    INTERVALS_PER_SECOND,
    Extent,
    column,
    columns_of,
    extent,
    extents,
)
from mount_models.quantity import ParameterError
from mount_ros.messages.force_table import ForceTable, from_message
from mount_ros.messages.scalars import MessageError
from mount_ros.topics import CURRENT_FORCE_TABLE, DISPLACEMENT, SIM_CHASSIS_ACCELERATION

WINDOW = 60.0  # s: kept for who comes later
_MM = 1e3
_ACCELERATION = 'linear_acceleration.z'


@dataclass(frozen=True)
class Interval:
    """One interval of the picture: number, time of its last sample (s), {key: extent in the shown unit}."""

    number: int
    time: float
    extents: dict[str, Extent]


class Model:
    """What is known of the graph that a feed shows; `listen` gets each new interval.

    An exception in its thread or in that of the feed ends the view: `failure` says which, and `on_failure` is
    called there.
    """

    def __init__(self, feed: Feed, *, beside: bool = True, on_failure: Callable[[], None] = lambda: None):
        self.failure = ''
        self._on_failure = on_failure
        self._feed = feed
        self._lock = threading.Lock()
        self._arrived: list[Message] = []
        self._wants_beside = beside
        self._table: ForceTable | None = None
        self._made_with: tuple[int, str] = (0, '')
        self.zero: int | None = None  # stamp (ns) at which time begins
        self._time = 0.0
        self._number = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='view', daemon=True)
        self._listeners: list[Callable[[Interval], None]] = []
        self._newest = 0  # ns, arrival
        space = next((name for name, topic in feed.topics.items() if topic is DISPLACEMENT), '/displacement')
        self.state = GraphState(namespace=space.removesuffix(f'/{DISPLACEMENT.name}'))
        self.intervals: deque[Interval] = deque(maxlen=round(WINDOW * INTERVALS_PER_SECOND))
        self.beside: Beside | None = None
        self.malformed = 0  # messages that could not be read
        if beside:
            Beside({}, None).advance([0], np.zeros(1))  # loads the compiled laws before anything comes

    def take(self, message: Message) -> None:
        """Take a message; cheap, from any thread."""
        with self._lock:
            self._arrived.append(message)

    def listen(self, listener: Callable[[Interval], None]) -> None:
        """Call `listener` with each interval from now on, from the thread of the model."""
        self._listeners.append(listener)

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
    def silent_nodes(self) -> list[str]:
        """The nodes that have said nothing for a while."""
        return self.state.silent(self._newest)

    def levels(self) -> dict[str, float]:
        """Return the amplitudes (mm) between which the policy of the drive opens, by their labels."""
        try:
            policy, own = policy_of(self.state.parameters)
        except (ParameterError, ValueError):
            return {}
        return {label: _MM * value for label, value in levels_of(policy, own).items()}

    def _serve(self) -> None:
        try:
            self._make_intervals()
        except Exception as error:
            self.fail(f'{type(error).__name__}: {error}')

    def _make_intervals(self) -> None:
        next_one = time.monotonic()
        while not self._ending.is_set():
            next_one += 1.0 / INTERVALS_PER_SECOND
            self._ending.wait(max(0.0, next_one - time.monotonic()))
            with self._lock:
                messages, self._arrived = self._arrived, []
            interval = self.interval(messages)
            for listener in self._listeners:
                listener(interval)

    def interval(self, messages: list[Message]) -> Interval:
        """Make an interval of what has arrived since the last one."""
        for message in messages:
            self._take_once(message)
        columns = columns_of(messages)
        found = extents(columns)
        stamps = columns[DISPLACEMENT].stamps if DISPLACEMENT in columns else np.empty(0, np.int64)
        if stamps.size:
            if self.zero is None:
                self.zero = int(stamps[0])
            self._time = (int(stamps[-1]) - self.zero) * 1e-9
        if messages:
            self._newest = messages[-1].received
        found |= self._beside_extents(columns)
        self._number += 1
        interval = Interval(self._number, self._time, found)
        self.intervals.append(interval)
        return interval

    def _take_once(self, message: Message) -> None:
        if message.topic.rate > 100.0:
            return  # a trace, not a state
        try:
            if message.topic is CURRENT_FORCE_TABLE:
                self._take_table(message)
            else:
                self.state.take(message)
        except (LayoutError, RuntimeError):  # of bytes that are no such message
            self.malformed += 1

    def _take_table(self, message: Message) -> None:
        from rclpy.serialization import deserialize_message
        from std_msgs.msg import Float64MultiArray

        try:
            self._table = from_message(deserialize_message(message.raw, Float64MultiArray))
        except MessageError:
            self._table = None

    def _beside_extents(self, columns) -> dict[str, Extent]:
        if not self._wants_beside or SIM_CHASSIS_ACCELERATION not in columns:
            return {}
        self._make_beside()
        if self.beside is None:
            return {}
        accelerations = column(columns, SIM_CHASSIS_ACCELERATION, _ACCELERATION)
        stamps = columns[SIM_CHASSIS_ACCELERATION].stamps
        if len(stamps) != len(accelerations):
            return {}
        found = self.beside.advance(stamps.tolist(), accelerations)
        return {f'beside.{key}': extent(_MM * values) for key, values in found.items()}

    def _make_beside(self) -> None:
        """Make the alternatives anew where table or parameters are others."""
        stamp = self._table.stamp if self._table is not None else 0
        made_with = stamp, repr(self.state.parameters)
        if made_with == self._made_with and self.beside is not None:
            return
        self._made_with = made_with
        offset = self.state.gap.get('offset_current', 0.0)
        try:
            self.beside = Beside(self.state.parameters, self._table, 0.0 if math.isnan(offset) else offset)
        except ValueError:  # parameters of another version
            self._wants_beside, self.beside = False, None
