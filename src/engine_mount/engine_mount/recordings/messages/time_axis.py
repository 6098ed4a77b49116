"""The one time that people are told: s from the first displacement sample of a recording."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.messages.compact_times import CompactTimes, Times, compact
from engine_mount.recordings.messages.series import SeriesError
from engine_mount.recordings.messages.stamps import misdated
from mount_recorder.chunk_groups import registered_topic
from mount_recorder.stamp_watch import FARTHEST
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, SIM_TRUTH

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, COIL_RIPPLE, CONTROL_TRACE, SIM_TRUTH)
_OTHER_CLOCK = 86_400.0  # s, chosen: what is so far off was told on another clock


class TimeAxis:
    """Time of a recording in s from the stamp `zero` (ns) of its first displacement sample.

    A recording without displacement counts from the first sample of what it has, one without stamps from its
    first message. What only has a log time happened when the sample was taken that came in just then: in
    lock-step the clock of reception knows nothing of the time in the stamps.
    """

    def __init__(
        self, stamps: Times | CompactTimes, received: Times | CompactTimes, told: Sequence[int] = ()
    ):
        """Take the samples, at least one, as they came in (ns), and zeros that origins tell of."""
        sound, came = _in_order(compact(stamps), compact(received))
        stamps, received = _in_time(sound, came)
        self._stamp_of = _Relation(received, stamps)
        self._arrival_of = _Relation(stamps, received)
        self.zero = min([sound.least, *told])

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
        return self._stamp_of.at(log_times)

    def of_mark(self, stamp: int, log_time: int) -> float:
        """Return the time of a mark: of its own stamp, unless it has none or one of another clock."""
        time = self.of_stamp(stamp)
        own = stamp != log_time and abs(time) < _OTHER_CLOCK
        return time if own else self.of_log(log_time)

    def log_time(self, seconds: float) -> int:
        """Return the log time (ns) that belongs to a time."""
        return int(self._arrival_of.at(np.array([self.zero + round(1e9 * seconds)]))[0])


class Arrivals(Protocol):
    """Samples of a topic: when they were taken and when they came in, ns."""

    @property
    def stamps(self) -> Times | CompactTimes | None: ...
    @property
    def receive_times(self) -> Times | CompactTimes | None: ...


def anchors(types: Mapping[str, str]) -> list[str]:
    """Return which of the topics {name: type} may tell the time of a recording, the best first."""
    return [
        name for topic in _ANCHORS for name, kind in types.items() if registered_topic(name, kind) is topic
    ]


def axis_of(
    types: Mapping[str, str], arrivals: Callable[[str], Arrivals], told: Sequence[int], first: int
) -> TimeAxis:
    """Return the axis of a recording with the topics {name: type} that have messages, read by `arrivals`.

    `told` are the zeros (ns) that it inherits, `first` is its first log time (ns).
    """
    for name in anchors(types):
        found = arrivals(name)
        try:
            stamps, received = found.stamps, found.receive_times
        except SeriesError:  # of a foreign topic
            continue
        if stamps is not None and received is not None and len(stamps):
            return TimeAxis(stamps, received, told)
    only = np.array([first])
    return TimeAxis(only, only, told)


def _in_order(stamps: CompactTimes, received: CompactTimes) -> tuple[CompactTimes, CompactTimes]:
    """Return the samples that are not misdated in the order in which they came in."""
    if stamps.longest_step <= FARTHEST and received.rising:
        return stamps, received
    all_stamps, all_received = stamps.whole(), received.whole()
    sound = ~misdated(all_stamps)
    all_stamps, all_received = all_stamps[sound], all_received[sound]
    order = np.argsort(all_received, kind='stable')
    return compact(all_stamps[order]), compact(all_received[order])


def _in_time(stamps: CompactTimes, received: CompactTimes) -> tuple[CompactTimes, CompactTimes]:
    """Return the samples without late ones, whose stamps are not above those before them."""
    if stamps.strictly_rising:
        return stamps, received
    kept, kept_arrivals = CompactTimes(), CompactTimes()
    highest = stamps.block(0)[0] - 1
    for block, arrivals in zip(stamps.blocks(), received.blocks(), strict=True):
        so_far = np.maximum.accumulate(np.append(highest, block))
        risen = so_far[1:] > so_far[:-1]
        kept.add(block[risen])
        kept_arrivals.add(arrivals[risen])
        highest = so_far[-1]
    return kept.finished(), kept_arrivals.finished()


class _Relation:
    """What belongs to a time: linear between known ones, at the same pace before and behind (all in ns)."""

    def __init__(self, known: CompactTimes, wanted: CompactTimes):
        self._known, self._wanted, self._firsts = known, wanted, known.firsts
        self._zeros = int(known.block(0)[0]), int(wanted.block(0)[0])
        self._last = known.highest
        self._near: tuple[int, Times, Times] | None = None  # the block that was looked at last

    def at(self, times: Times) -> Times:
        first, zero = self._zeros
        inside = np.empty(len(times), np.int64)
        blocks = np.maximum(np.searchsorted(self._firsts, times, side='right') - 1, 0)
        for number in np.unique(blocks).tolist():
            known, wanted = self._around(number)
            here = blocks == number
            inside[here] = np.rint(np.interp(times[here] - first, known - first, wanted - zero))
        return zero + inside + np.minimum(times - first, 0) + np.maximum(times - self._last, 0)

    def _around(self, number: int) -> tuple[Times, Times]:
        """Return the known times of a block and what belongs to them, up to the first of the next."""
        if self._near is None or self._near[0] != number:
            following = range(number, min(number + 2, len(self._firsts)))
            known, wanted = (
                np.concatenate([each.block(number), *(each.block(one)[:1] for one in following[1:])])
                for each in (self._known, self._wanted)
            )
            self._near = number, known, wanted
        return self._near[1:]
