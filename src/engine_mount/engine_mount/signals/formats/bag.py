"""MCAP files and rosbag2 folders: every number of every topic as `/topic.field`."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
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
    values: dict[tuple[str, str], FloatArray] = {}
    clocks: dict[str, TimeBase] = {}
    try:
        recording = open_recording(path)
        fields = list(_fields(recording))
    except ReadingError as error:
        raise SignalError(str(error)) from None

    def prepare(numbers: Sequence[int]) -> None:
        wanted: dict[str, list[str]] = {}
        for number in numbers:
            topic, field, _ = fields[number]
            wanted.setdefault(topic, []).append(field)
        try:
            recording.load_columns(wanted)
            for topic, names in wanted.items():
                clocks[topic] = _clock(recording[topic])
                values.update(
                    {(topic, name): np.asarray(recording[topic][name], np.float64) for name in names}
                )
        except ReadingError as error:
            raise SignalError(str(error)) from None

    leaves = [
        Leaf(
            f'{topic}.{field}', partial(values.__getitem__, (topic, field)), unit, field,
            clock=partial(clocks.__getitem__, topic),
        )
        for topic, field, unit in fields
    ]  # fmt: skip
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
