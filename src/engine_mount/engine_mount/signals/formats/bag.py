"""MCAP files and rosbag2 folders: every number of every topic as `/topic.field`."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from engine_mount.recordings.recording import ReadingError, open_recording
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase, unique
from engine_mount.signals.signal import SignalError

_SECOND = 1_000_000_000  # ns
_STAMP = 'header.stamp.'
UNITS = {
    'sensor_msgs/msg/Imu': {'linear_acceleration.': 'm/s^2', 'angular_velocity.': 'rad/s'},
    'geometry_msgs/msg/AccelStamped': {'accel.linear.': 'm/s^2', 'accel.angular.': 'rad/s^2'},
    'geometry_msgs/msg/TwistStamped': {'twist.linear.': 'm/s', 'twist.angular.': 'rad/s'},
    'geometry_msgs/msg/WrenchStamped': {'wrench.force.': 'N', 'wrench.torque.': 'N m'},
    'geometry_msgs/msg/PointStamped': {'point.': 'm'},
    'sensor_msgs/msg/Range': {'range': 'm'},
    'sensor_msgs/msg/Temperature': {'temperature': 'degC'},
    'sensor_msgs/msg/FluidPressure': {'fluid_pressure': 'Pa'},
    'sensor_msgs/msg/MagneticField': {'magnetic_field.': 'T'},
}
"""Units by beginnings of paths, as the definitions of common_interfaces (Jazzy) and REP 103 say."""


class Bag:
    """A recording of ROS 2, whole or in part; raises `SignalError`."""

    def __init__(self, path: Path, stated: Stated):
        self.format, self.reader = 'rosbag2', 'engine_mount.recordings'
        self._path = path
        try:
            self._recording = open_recording(path)
            self._places = list(self._found())
        except ReadingError as error:
            raise SignalError(str(error)) from None
        self.notes: list[str] = self._recording.warnings
        if not self._places:
            raise SignalError(
                f'{path} holds no message with numbers; its topics: {", ".join(self._recording) or "none"}'
            )
        self.headings: Sequence[Heading] = unique([
            Heading(f'{topic}.{field}', field, unit, 0, timed=True) for topic, field, unit in self._places
        ])  # fmt: skip

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen fields at the stamps of their messages, else at the times of arrival."""
        wanted: dict[str, list[str]] = {}
        for heading in chosen:
            topic, field, _ = self._places[heading.number]
            wanted.setdefault(topic, []).append(field)
        try:
            self._recording.load_columns(wanted)
            times = {topic: _time(self._recording[topic]) for topic in wanted}
            found = []
            for heading in chosen:
                topic, field, _ = self._places[heading.number]
                values = np.asarray(self._recording[topic][field], np.float64)
                found.append(heading.measured(values, times[topic]))
        except (ReadingError, SeriesError) as error:
            raise SignalError(str(error)) from None
        return found

    def _found(self) -> Iterator[tuple[str, str, str]]:
        """Yield topic, field and unit of all numbers, by the first message of each topic."""
        for topic in self._recording:
            try:
                series = next(self._recording.parts([topic], 1), None)
                names = () if series is None else series.names
            except SeriesError:
                continue
            for field in names:
                if series is not None and not field.startswith(_STAMP):
                    yield topic, field, series.unit(field) or _unit(series.type, field)


def _time(series: Series) -> TimeBase:
    try:
        stamps, told = series.stamps, 'header stamps'
    except SeriesError:
        stamps = np.zeros(0, np.int64)
    if not np.any(stamps > 0):
        stamps, told = series.receive_times, 'times of arrival (the messages carry none of their own)'
    begin = int(stamps[0]) if stamps.size else 0
    return TimeBase((stamps - begin) / _SECOND, begin, told)


def _unit(kind: str, field: str) -> str:
    units = UNITS.get(kind, {})
    return next((unit for start, unit in units.items() if field.startswith(start)), '')
