"""The one time that people are told: s from the first displacement sample of a recording."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mount_bags.messages.series import SeriesError, Times, registered_topic
from mount_bags.messages.stamps import misdated
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, SIM_TRUTH

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, COIL_RIPPLE, CONTROL_TRACE, SIM_TRUTH)
_OTHER_CLOCK = 86_400.0  # s, chosen: what is so far off was told on another clock


class TimeAxis:
    """Time of a recording in s from the stamp `zero` (ns) of its first displacement sample.

    A recording without displacement counts from the first sample of what it has, one without stamps from its
    first message. What only has a log time happened when the sample was taken that came in just then: in
    lock-step the clock of reception knows nothing of the time in the stamps.
    """

    def __init__(self, stamps: Times, received: Times, told: Sequence[int] = ()):
        """Take the samples, at least one, as they came in (ns), and zeros that origins tell of."""
        sound = ~misdated(stamps)
        stamps, received = stamps[sound], received[sound]
        order = np.argsort(received, kind='stable')
        highest = np.maximum.accumulate(stamps[order])
        # A late sample moves nothing: its stamp is not above those before it.
        rising = np.flatnonzero(np.diff(highest, prepend=highest[0] - 1) > 0)
        self._stamps, self._received = highest[rising], received[order][rising]
        self.zero = min([int(stamps.min()), *told])

    def of_stamps(self, stamps: Times) -> NDArray[np.float64]:
        """Return the times of stamps (ns)."""
        return np.asarray((stamps - self.zero) / 1e9, np.float64)

    def of_stamp(self, stamp: int) -> float:
        """Return the time of one stamp (ns)."""
        return (stamp - self.zero) / 1e9

    def of_log(self, log_time: int) -> float:
        """Return the time at which a message was logged (ns)."""
        return float(self.of_logs(np.array([log_time]))[0])

    def of_logs(self, log_times: Times) -> NDArray[np.float64]:
        """Return the times at which messages were logged (ns)."""
        return self.of_stamps(self.stamps_at(log_times))

    def stamps_at(self, log_times: Times) -> Times:
        """Return the stamps (ns) that samples would have which came in at log times (ns)."""
        return _between(log_times, self._received, self._stamps)

    def of_mark(self, stamp: int, log_time: int) -> float:
        """Return the time of a mark: of its own stamp, unless it has none or one of another clock."""
        time = self.of_stamp(stamp)
        own = stamp != log_time and abs(time) < _OTHER_CLOCK
        return time if own else self.of_log(log_time)

    def log_time(self, seconds: float) -> int:
        """Return the log time (ns) that belongs to a time."""
        stamp = np.array([self.zero + round(1e9 * seconds)])
        return int(_between(stamp, self._stamps, self._received)[0])


class Arrivals(Protocol):
    """Samples of a topic: when they were taken and when they came in, ns."""

    @property
    def stamps(self) -> Times | None: ...
    @property
    def receive_times(self) -> Times: ...


def axis_of(
    types: Mapping[str, str], arrivals: Callable[[str], Arrivals], told: Sequence[int], first: int
) -> TimeAxis:
    """Return the axis of a recording with the topics {name: type} that have messages, read by `arrivals`.

    `told` are the zeros (ns) that it inherits, `first` is its first log time (ns).
    """
    for topic in _ANCHORS:
        for name in (name for name, kind in types.items() if registered_topic(name, kind) is topic):
            found = arrivals(name)
            try:
                stamps = found.stamps
            except SeriesError:  # of a foreign topic
                continue
            if stamps is not None and stamps.size:
                return TimeAxis(stamps, found.receive_times, told)
    only = np.array([first])
    return TimeAxis(only, only, told)


def _between(places: Times, known: Times, wanted: Times) -> Times:
    """Return what belongs to `places`: linear between known places, at the same pace before and behind."""
    inside = np.rint(np.interp(places - known[0], known - known[0], wanted - wanted[0])).astype(np.int64)
    before, behind = np.minimum(places - known[0], 0), np.maximum(places - known[-1], 0)
    return wanted[0] + inside + before + behind
