"""The signals of a recording as arrays over seconds, and what it lacks, in words."""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.events import recorded_marks, switching_times
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.session import recorded_sample_rate, recorded_session
from engine_mount.recordings.times import Times, each_once
from engine_mount.reports.drawing.chart import Array
from engine_mount.reports.drive.signals import DRIVE_COLUMNS
from mount_ros.messages.event import Mark
from mount_ros.topics import (
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    SIM_CHASSIS_ACCELERATION,
    SIM_MOUNT_FORCE,
    SIM_TRUTH,
)

# What a report may ask for, to be read in one pass. The first names stand for their topics.
_SHOWN = {
    DISPLACEMENT.name: ('mount',),
    COIL_RIPPLE.name: ('coil_current',),
    CURRENT_SETPOINT.name: ('coil_current',),
    CONTROL_TRACE.name: (CONTROL_TRACE.names[0], *DRIVE_COLUMNS[CONTROL_TRACE.name]),
    SIM_TRUTH.name: DRIVE_COLUMNS[SIM_TRUTH.name],
    SIM_MOUNT_FORCE.name: ('wrench.force.z',),
    SIM_CHASSIS_ACCELERATION.name: ('linear_acceleration.z',),
}


@dataclass(frozen=True)
class Signal:
    """One signal: times in s on the recording's time axis, rising, and values in SI units."""

    time: Array
    values: Array


class _Order(NamedTuple):
    """In which order the values of a topic with these `stamps` (ns) are taken, and their times (s)."""

    stamps: Times
    time: Array
    places: slice | NDArray[np.intp]


class Signals:
    """The signals of one recording. What is asked for and not there is noted in `missing`, in words."""

    def __init__(self, recording: Recording, name: str = ''):
        """Take a recording and what to call it."""
        self.recording = recording
        self.name = name or recording.short_name
        self.missing: list[str] = []
        self._found: dict[tuple[str, str], Signal | None] = {}
        self._orders: dict[str, _Order] = {}
        recording.load_columns({topic: names for topic, names in _SHOWN.items() if topic in recording})
        self.axis = recording.time_axis
        self.zero = self.axis.zero
        """The stamp (ns) at which time begins; another may be set before the first signal is asked for."""

    @property
    def session(self) -> str:
        """The text of its session message, empty where it has none."""
        try:
            return recorded_session(self.recording)
        except (ReadingError, SeriesError):
            return ''

    @functools.cached_property
    def sample_rate(self) -> float:
        """Hz, as its session tells."""
        return recorded_sample_rate(self.recording)

    def signal(self, topic: str, column: str) -> Signal | None:
        """Return a column of a topic, None (and a note in `missing`) where it cannot be had."""
        key = (topic, column)
        if key not in self._found:
            try:
                series = self.recording[topic]
                self._found[key] = self._ordered(series, series[column]) if len(series) else None
                if not len(series):
                    self._note(f'{topic} has no message')
            except ReadingError:
                self._note(self._absence(topic))
                self._found[key] = None
            except SeriesError as error:
                self._note(f'not as this project records it: {error}')
                self._found[key] = None
        return self._found[key]

    def damping(self) -> list[tuple[float, float]] | None:
        """Return the stretches (s) in which damping was on, None where the recording does not tell."""
        active = self.signal(CONTROL_TRACE.name, 'damping_active')
        if active is None:
            return None
        on, off = switching_times(active.time, active.values)
        ends = np.append(off, active.time[-1])
        return [(float(begin), float(ends[np.searchsorted(ends, begin)])) for begin in on]

    def marks(self) -> list[tuple[float, Mark]]:
        """Return its marks with their times (s), none where there is no readable topic of them."""
        shift = (self.axis.zero - self.zero) / 1e9
        try:
            return [
                (self.axis.of_mark(mark.time, time) + shift, mark)
                for marks in recorded_marks(self.recording).values()
                for time, mark in marks
            ]
        except (ReadingError, SeriesError):
            return []

    def _ordered(self, series: Series, values: Array) -> Signal:
        if series.topic not in self._orders:
            alike = (order for order in self._orders.values() if order.stamps is series.stamps)
            self._orders[series.topic] = next(alike, None) or self._order_of(series.stamps)
        order = self._orders[series.topic]
        found = np.asarray(values, np.float64)[order.places]
        return Signal(order.time, found)

    def _order_of(self, stamps: Times) -> '_Order':
        rising, places = each_once(stamps)
        return _Order(
            stamps,
            (rising - self.zero) / 1e9,
            places,
        )

    def _absence(self, topic: str) -> str:
        alike = [name for name in self.recording if name.endswith(f'/{topic}')]
        if len(alike) > 1:
            return f'{topic} is there more than once ({", ".join(alike)}); cut out one mount first'
        return f'there is no topic {topic}'

    def _note(self, sentence: str) -> None:
        if sentence not in self.missing:
            self.missing.append(sentence)
