"""Times of messages in ns; samples that are missing, repeated or out of order by their stamps.

The step between neighbouring stamps is rounded to whole sample periods. So a clock of the electronics
that runs a little fast or slow, as every clock does, is not taken for lost samples, and where the rate
is kept the expected number is round((last - first) * rate) + 1.

A stamp that is late or early by part of a period is neither lost nor twice; where many are, as in those of a
phone, nothing can be counted.

A stamp far from those of the samples around it is no time of a sample: misdated, and counted as that alone.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.metadata import registered_topic
from mount_recorder.stamp_watch import FARTHEST, LONGEST_PAUSE
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, SIM_TRUTH

Times = NDArray[np.int64]

NO_TIMES: Times = np.empty(0, np.int64)
_NANOSECONDS = 1_000_000_000
_JITTER = 0.25  # periods, chosen: steps so far from whole ones are no clock's drift
MOST_JITTER = 0.01
"""Share of the stamps, chosen: of more that are beside the rate, losses cannot be counted."""
_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, COIL_RIPPLE, CONTROL_TRACE, SIM_TRUTH)
_OTHER_CLOCK = 86_400.0  # s, chosen: what is so far off is of another clock
_AROUND = 5  # samples, chosen: before and behind; so many stamps in a row may be misdated


def distinct(times: Times) -> Times:
    """Return the distinct times, rising; `np.unique` hashes them, which takes ten times as long."""
    if bool((times[1:] > times[:-1]).all()):
        return times
    times = ordered(times)
    return times[np.append(True, times[1:] > times[:-1])]


def ordered(times: Times) -> Times:
    """Return times sorted; no copy where they are."""
    return times if bool((times[1:] >= times[:-1]).all()) else np.sort(times)


def each_once(times: Times) -> tuple[Times, 'slice | NDArray[np.intp]']:
    """Return the distinct times, rising, and where the first of each stands; no copies where they rise."""
    if bool((times[1:] > times[:-1]).all()):
        return times, slice(None)
    return np.unique(times, return_index=True)


def is_in(times: Times, known: Times) -> NDArray[np.bool_]:
    """Return which of the times are among `known`, which rise."""
    if not len(known):
        return np.zeros(len(times), bool)
    return known[np.minimum(np.searchsorted(known, times), len(known) - 1)] == times


class StampStatistics(NamedTuple):
    """Counts of samples; `longest_gap_s` between neighbouring stamps in s, NaN below two samples."""

    expected: int
    present: int
    lost: int
    duplicated: int
    out_of_order: int
    longest_gap_s: float


def stamp_statistics(stamps: Times, rate: float) -> StampStatistics:
    """Return the statistics of `stamps` (ns, in the order of arrival) of a topic with `rate` in Hz."""
    if not len(stamps):
        return StampStatistics(0, 0, 0, 0, 0, math.nan)
    rising = ordered(stamps)
    differences = np.diff(rising)
    periods = differences * (rate / _NANOSECONDS)
    steps = np.rint(periods)
    expected, filled = 1 + int(steps.sum()), 1 + int(np.count_nonzero(steps))
    if np.any((np.abs(periods - steps) > _JITTER) | ((steps == 0) & (differences > 0))):
        filled = min(expected, 1 + int(np.count_nonzero(differences)))
    return StampStatistics(
        expected=expected,
        present=len(stamps),
        lost=expected - filled,
        duplicated=len(stamps) - filled,
        out_of_order=0 if rising is stamps else _out_of_order(stamps),
        longest_gap_s=int(differences.max()) / _NANOSECONDS if len(stamps) > 1 else math.nan,
    )


def jitter_share(stamps: Times, rate: float) -> float:
    """Return the share of stamps (ns) that are more than a quarter of a period beside the rate (Hz)."""
    periods = np.diff(distinct(stamps)) * (rate / _NANOSECONDS)
    return float(np.mean(np.abs(periods - np.rint(periods)) > _JITTER)) if periods.size else 0.0


def _out_of_order(stamps: Times) -> int:
    """Return how many stamps are below one before them."""
    return int(np.count_nonzero(stamps[1:] < np.maximum.accumulate(stamps)[:-1]))


def misdated(stamps: Times) -> NDArray[np.bool_]:
    """Return which of `stamps` (ns, in the order of arrival) cannot be the times of their samples."""
    wrong = np.zeros(len(stamps), bool)
    if stamps.size < 3:
        return wrong
    steps = np.abs(np.diff(stamps))
    if not (steps > FARTHEST).any():
        return wrong
    # Where no step is so long, none of those around a stamp is too far from it.
    long = np.flatnonzero(steps > FARTHEST // _AROUND)
    near = (long[:, None] + np.arange(1 - _AROUND, _AROUND + 1)).clip(0, len(stamps) - 1)
    near = distinct(near.ravel())
    edges = np.pad(stamps, _AROUND, mode='reflect' if stamps.size > _AROUND else 'edge')
    around = np.lib.stride_tricks.sliding_window_view(edges, 2 * _AROUND + 1)[near]
    wrong[near] = np.abs(stamps[near] - np.sort(around, axis=1)[:, _AROUND]) > FARTHEST
    sound = np.sort(stamps[~wrong])
    borders = np.flatnonzero(np.diff(sound) > LONGEST_PAUSE) + 1
    longest = max(np.split(sound, borders), key=len)
    return wrong | (stamps < longest[0]) | (stamps > longest[-1]) if longest.size else wrong


def redated(stamps: Times, wrong: NDArray[np.bool_], rate: float) -> Times:
    """Return `stamps` with those that are `wrong` set to where `rate` (Hz) puts their samples."""
    if not wrong.any() or wrong.all():
        return stamps
    known = np.flatnonzero(~wrong)
    places = np.arange(len(stamps))
    before = known[np.maximum(np.searchsorted(known, places, side='right') - 1, 0)]
    return stamps[before] + np.rint((places - before) * (_NANOSECONDS / rate)).astype(np.int64)


def missing_samples(streams: Sequence[Times], rate: float) -> int:
    """Return how many samples are missing in at least one of `streams` that carry their parts.

    `streams` are stamps (ns) on one clock, of samples at `rate` in Hz. A stream is whole before its first and
    behind its last stamp; a sample that is missing in several counts once.
    """
    known = [distinct(stamps) for stamps in streams if len(stamps)]
    if not known:
        return 0
    grid = distinct(np.concatenate(known))
    numbers = np.cumsum(np.rint(np.diff(grid, prepend=grid[0]) * (rate / _NANOSECONDS)).astype(np.int64))
    seen = distinct(numbers)
    lacking = np.zeros(len(seen), bool)
    for stamps in known:
        own = distinct(numbers[np.searchsorted(grid, stamps)])
        lacking |= (seen >= own[0]) & (seen <= own[-1]) & ~is_in(seen, own)
    return int(seen[-1] + 1 - len(seen) + np.count_nonzero(lacking))


class TimeAxis:
    """Time of a recording in s from the stamp `zero` (ns) of its first displacement sample.

    A recording without displacement counts from the first sample of what it has, one without stamps from its
    first message. What only has a log time happened when the sample was taken that came in just then: in
    lock-step the clock of reception knows nothing of the time in the stamps.
    """

    def __init__(self, stamps: Times, received: Times, inherited: Sequence[int] = ()):
        """Take the samples, at least one, as they came in (ns), and zeros that origins tell of."""
        wrong = misdated(stamps)
        sound = np.flatnonzero(~wrong | wrong.all())
        order = sound[np.argsort(received[sound], kind='stable')]
        stamps, received = stamps[order], received[order]
        self.zero = min([int(stamps.min()), *inherited])
        on_time = np.append(True, stamps[1:] > np.maximum.accumulate(stamps)[:-1])
        self._stamps, self._received = stamps[on_time], received[on_time]

    def of_stamps(self, stamps: Times) -> NDArray[np.float64]:
        """Return the times of stamps (ns)."""
        return np.asarray((stamps - self.zero) / 1e9, np.float64)

    def of_stamp(self, stamp: int) -> float:
        """Return the time of one stamp (ns)."""
        return (stamp - self.zero) / 1e9

    def of_log(self, log_time: int) -> float:
        """Return the time at which a message was logged (ns)."""
        return float(self.of_logs(np.int64(log_time)))

    def of_logs(self, log_times: Any) -> NDArray[np.float64]:
        """Return the times at which messages were logged (ns)."""
        return self.of_stamps(self.stamps_at(log_times))

    def stamps_at(self, log_times: Any) -> Times:
        """Return the stamps (ns) that samples would have which came in at log times (ns)."""
        return _related(log_times, self._received, self._stamps)

    def of_mark(self, stamp: int, log_time: int) -> float:
        """Return the time of a mark: of its own stamp, unless it has none or one of another clock."""
        time = self.of_stamp(stamp)
        own = stamp != log_time and abs(time) < _OTHER_CLOCK
        return time if own else self.of_log(log_time)

    def log_time(self, seconds: float) -> int:
        """Return the log time (ns) that belongs to a time."""
        return int(_related(self.zero + round(1e9 * seconds), self._stamps, self._received))


def anchors(types: Mapping[str, str]) -> list[str]:
    """Return which of the topics {name: type} may tell the time of a recording, the best first."""
    return [
        name for topic in _ANCHORS for name, kind in types.items() if registered_topic(name, kind) is topic
    ]


def _related(times: Any, known: Times, wanted: Times) -> Times:
    """Return what belongs to times: linear between known ones, at the same pace before and behind (ns)."""
    passed = ((each - each[0]).astype(float) for each in (known, wanted))
    inside = np.rint(np.interp(times - known[0], *passed)).astype(np.int64)
    before, behind = np.minimum(times - known[0], 0), np.maximum(times - known[-1], 0)
    return np.asarray(wanted[0] + inside + before + behind)
