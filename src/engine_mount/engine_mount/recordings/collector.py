"""Chosen columns and times of one topic, put together part by part."""

import contextlib
from collections.abc import Callable, Iterable

import numpy as np

from engine_mount.recordings.series import Series, SeriesError
from mount_ros.topics import JOINT_STATE

RECEIVED, SENT, STAMPS = '/received', '/sent', '/stamps'
"""Names of times among columns; no field has such a name."""
_TIMES: dict[str, Callable[[Series], np.ndarray]] = {
    RECEIVED: lambda series: series.receive_times,
    SENT: lambda series: series.publish_times,
    STAMPS: lambda series: series.stamps,
}
_MOST_EXPECTED = 1 << 24  # chosen: a file may claim any number of messages


class Collector:
    """Fills one array for each column: many small ones would fragment the memory of a long recording.

    A column that is not in each message is left out, with the reason in `obstacles`.
    """

    def __init__(self, columns: Iterable[str], expected: int):
        """Make room for so many messages; more may come."""
        self.count = 0
        self.names: tuple[str, ...] = ()
        """Of the scalars in the first messages of a `JointState`."""
        self.obstacles: dict[str, str] = {}
        self._arrays = {
            name: np.empty(min(expected, _MOST_EXPECTED), np.int64 if name in _TIMES else np.float64)
            for name in columns
        }

    def add(self, part: Series) -> None:
        """Add the messages of a part."""
        if not self.count and part.type == JOINT_STATE:
            with contextlib.suppress(SeriesError):
                self.names = part.names
        begin, self.count = self.count, self.count + len(part)
        for name in tuple(self._arrays):
            if self.count > len(self._arrays[name]):
                self._arrays[name] = np.resize(self._arrays[name], 2 * self.count)
            try:
                values = _TIMES[name](part) if name in _TIMES else part[name]
                self._arrays[name][begin : self.count] = values
            except SeriesError as error:
                self.obstacles[name] = str(error)
                del self._arrays[name]

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The columns that every message has; none without messages."""
        return {name: array[: self.count] for name, array in self._arrays.items() if self.count}
