"""MCAP files and rosbag2 folders: every number of every topic as `/topic.field`."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache, partial
from itertools import islice
from pathlib import Path

import numpy as np

from engine_mount.recordings.recording import ReadingError, Recording, open_recording
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.signals.formats.content import Content, Leaf, Stated
from engine_mount.signals.formats.measured import FloatArray, TimeBase
from engine_mount.signals.signal import SECOND, SignalError

UNITS = {
    'sensor_msgs/msg/Imu': {'linear_acceleration.': 'm/s^2', 'angular_velocity.': 'rad/s'},
    'geometry_msgs/msg/AccelStamped': {'accel.linear.': 'm/s^2', 'accel.angular.': 'rad/s^2'},
    'geometry_msgs/msg/TwistStamped': {'twist.linear.': 'm/s', 'twist.angular.': 'rad/s'},
    'geometry_msgs/msg/WrenchStamped': {'wrench.force.': 'N', 'wrench.torque.': 'N m'},
}
"""Units by beginnings of paths, as the definitions of common_interfaces (Jazzy) and REP 103 say."""


def open_bag(path: Path, stated: Stated) -> Content:
    """Return the fields of a recording of ROS 2, whole or in part; raises `SignalError`."""
    try:
        recording = open_recording(path)
        fields = list(_fields(recording))
    except ReadingError as error:
        raise SignalError(str(error)) from None

    def prepare(numbers: Sequence[int]) -> None:
        wanted = defaultdict[str, list[str]](list)
        for topic, field, _ in map(fields.__getitem__, numbers):
            wanted[topic].append(field)
        recording.load_columns(wanted)

    def column(topic: str, field: str) -> FloatArray:
        try:
            return np.asarray(recording[topic][field], np.float64)
        except ReadingError as error:
            raise SignalError(str(error)) from None

    clock = cache(lambda topic: _clock(recording[topic]))
    leaves = [
        Leaf(f'{topic}.{field}', partial(column, topic, field), unit, field, clock=partial(clock, topic))
        for topic, field, unit in fields
    ]
    notes = recording.warnings
    if not fields:
        notes = [*notes, f'its topics: {", ".join(recording) or "none"}']
    return Content(path, 'rosbag2', 'engine_mount.recordings', leaves, notes, prepare)


def _fields(recording: Recording) -> Iterator[tuple[str, str, str]]:
    """Yield topic, field and unit of all numbers, by the first message of each topic."""
    for topic in recording:
        with suppress(SeriesError):
            for series in islice(recording.parts([topic], 1), 1):
                units = UNITS.get(series.type, {}).items()
                for field in series.names:
                    if not field.startswith('header.stamp.'):
                        known = next((unit for start, unit in units if field.startswith(start)), '')
                        yield topic, field, series.unit(field) or known


def _clock(series: Series) -> TimeBase:
    try:
        stamps, told = series.stamps, 'header stamps'
    except SeriesError:
        stamps = np.zeros(0, np.int64)
    if not np.any(stamps > 0):
        stamps, told = series.receive_times, 'times of arrival (the messages carry none of their own)'
    begin = int(stamps[0]) if stamps.size else 0
    return TimeBase((stamps - begin) / SECOND, begin, told)
