"""The signals of a recording as arrays over seconds, and what it lacks, in words."""

from dataclasses import dataclass

import numpy as np

from mount_bags.event_marks import read_marks
from mount_bags.origin import short_name
from mount_bags.reading import ReadingError, Recording
from mount_bags.report.chart import Array
from mount_bags.series import Series, SeriesError
from mount_bags.session_differences import session_text
from mount_bags.switching_changes import switching_times
from mount_ros.event_message import Mark
from mount_ros.topics import (
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    EVENT,
    SIM_TRUTH,
)

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, COIL_RIPPLE, CONTROL_TRACE, SIM_TRUTH)
_OTHER_CLOCK = 86_400_000_000_000  # ns, chosen: marks so far off are of another clock


@dataclass(frozen=True)
class Signal:
    """One signal: times in s from the first sample of the recording, rising, and values in SI units."""

    time: Array
    values: Array


class Signals:
    """The signals of one recording. What is asked for and not there is noted in `missing`, in words."""

    def __init__(self, recording: Recording, name: str = '', zero: int | None = None):
        """Take a recording and what to call it; `zero` (ns) is where its time begins, if not at its start."""
        self.recording = recording
        self.name = name or short_name(recording)
        self.missing: list[str] = []
        self._found: dict[tuple[str, str], Signal | None] = {}
        self.zero = self._first_stamp() if zero is None else zero

    @property
    def session(self) -> str:
        """The text of its session message, empty where it has none."""
        try:
            return session_text(self.recording)
        except (ReadingError, SeriesError):
            return ''

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

    def marks(self) -> list[Mark]:
        """Return its marks, none where there is no readable topic of them."""
        try:
            return read_marks(self.recording[EVENT.name]) if EVENT.name in self.recording else []
        except (ReadingError, SeriesError, AttributeError):
            return []

    def seconds(self, mark: Mark) -> float:
        """Return the time of a mark in s from the first sample, NaN where it is of another clock."""
        passed = mark.time - self.zero
        return passed / 1e9 if abs(passed) < _OTHER_CLOCK else float('nan')

    def _ordered(self, series: Series, values: Array) -> Signal:
        stamps, places = np.unique(series.stamps, return_index=True)
        return Signal((stamps - self.zero) / 1e9, np.asarray(values, np.float64)[places])

    def _first_stamp(self) -> int:
        for topic in _ANCHORS:
            try:
                if topic.name in self.recording and len(self.recording[topic.name]):
                    return int(self.recording[topic.name].stamps.min())
            except SeriesError:
                continue
        found = self.recording.time_range
        return found[0] if found else 0

    def _absence(self, topic: str) -> str:
        alike = [name for name in self.recording if name.endswith(f'/{topic}')]
        if len(alike) > 1:
            return f'{topic} is there more than once ({", ".join(alike)}); cut out one mount first'
        return f'there is no topic {topic}'

    def _note(self, sentence: str) -> None:
        if sentence not in self.missing:
            self.missing.append(sentence)
