"""The one time axis shown to users: s from the first displacement sample of a recording."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.times import Times, misdated
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, SIM_TRUTH

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, COIL_RIPPLE, CONTROL_TRACE, SIM_TRUTH)
_OTHER_CLOCK = 86_400.0  # s, chosen: what is so far off is of another clock


class TimeAxis:
    """Time of a recording in s from the stamp `zero` (ns) of its first displacement sample.

    A recording without displacement counts from the first sample of what it has, one without stamps from its
    first message. What only has a log time happened when the sample was taken that came in just then: in
    lock-step the clock of reception knows nothing of the time in the stamps.
    """

    def __init__(self, stamps: Times, received: Times, inherited: Sequence[int] = ()):
        """Take the samples, at least one, as they came in (ns), and zeros that origins tell of."""
        sound, came = _in_order(stamps, received)
        stamps, received = _in_time(sound, came)
        self._stamps, self._received = _Known(stamps), _Known(received)
        self.zero = min([int(sound.min()), *inherited])

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
        return _related(log_times, self._received, self._stamps)

    def of_mark(self, stamp: int, log_time: int) -> float:
        """Return the time of a mark: of its own stamp, unless it has none or one of another clock."""
        time = self.of_stamp(stamp)
        own = stamp != log_time and abs(time) < _OTHER_CLOCK
        return time if own else self.of_log(log_time)

    def log_time(self, seconds: float) -> int:
        """Return the log time (ns) that belongs to a time."""
        return int(_related(np.array([self.zero + round(1e9 * seconds)]), self._stamps, self._received)[0])


def anchors(types: Mapping[str, str]) -> list[str]:
    """Return which of the topics {name: type} may tell the time of a recording, the best first."""
    return [
        name for topic in _ANCHORS for name, kind in types.items() if registered_topic(name, kind) is topic
    ]


def _in_order(stamps: Times, received: Times) -> tuple[Times, Times]:
    """Return the samples that are not misdated in the order in which they came in."""
    wrong = misdated(stamps)
    if not wrong.any() and (received[1:] >= received[:-1]).all():
        return stamps, received  # hours of samples need no copies
    sound = np.flatnonzero(~wrong | wrong.all())
    order = sound[np.argsort(received[sound], kind='stable')]
    return stamps[order], received[order]


def _in_time(stamps: Times, received: Times) -> tuple[Times, Times]:
    """Return the samples without late ones, whose stamps are not above those before them."""
    on_time = np.append(True, stamps[1:] > np.maximum.accumulate(stamps)[:-1])
    return (stamps, received) if on_time.all() else (stamps[on_time], received[on_time])


class _Known:
    """Known times: the first and the last in ns, all of them in ns from the first."""

    def __init__(self, times: Times):
        self.first, self.last = times[0], times[-1]
        self.passed = (times - times[0]).astype(float)


def _related(times: Times, known: _Known, wanted: _Known) -> Times:
    """Return what belongs to times: linear between known ones, at the same pace before and behind (ns)."""
    inside = np.rint(np.interp(times - known.first, known.passed, wanted.passed)).astype(np.int64)
    before, behind = np.minimum(times - known.first, 0), np.maximum(times - known.last, 0)
    return np.asarray(wanted.first + inside + before + behind)
