"""Judges each displacement sample by its stamp before the controller sees it; knows no clock."""

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from mount_control.force_to_current import ForceTableError
from mount_control.parameters import ControlParameters
from mount_control.plausibility import Plausibility
from mount_models.sampling import SAMPLE_TIME_NS, sample_time_ns

_NANOSECONDS = 1e9
_COUNTED = 50  # chosen: samples from which their rate is known
_LOOKED_BACK = 200  # chosen: steps between samples of which their rate is taken
_RATE_TOLERANCE = 0.2  # chosen: less than any other rate lies beside
_CLOSEST = 0.75  # of a period, chosen: mount_driver's stamps lie 0.9 of a period apart or more
_INTRUSIONS = 3  # chosen: samples between those of the stream
_INTRUSION_PERIOD = 1_000_000_000  # ns, chosen: in it they are those of another sender
_STREAM_BREAK = 1_000_000_000  # ns, chosen: a longer silence may have been a loss of power

INTERRUPTED = (
    'the measurements were interrupted for more than 1 s since the table was made, or their time '
    'went back; deactivate mount_control and activate mount_init again'
)


class Judgement(Enum):
    """What to do with a sample."""

    USE = 'use'
    RESTART = 'restart'  # usable, but the past is too far away to be continued
    INVALID = 'invalid'  # NaN or beyond the sensor's range: answered with 0 A
    IMPLAUSIBLE = 'implausible'  # it moves as no mount does, see `plausibility`: answered with 0 A
    INTERRUPTED = 'interrupted'  # the table may be of another state of the mount: answered with 0 A
    IGNORE = 'ignore'  # repeated or out of order: already answered
    FOREIGN = 'foreign'  # another sender is or may be there: answered with 0 A
    EARLY = 'early'  # not after the activation: mount_init answers
    INACTIVE = 'inactive'  # nobody asked for an answer


@dataclass
class SampleCounts:
    """What came in since activation."""

    samples: int = 0
    bridged: int = 0
    restarts: int = 0
    ignored: int = 0
    invalid: int = 0
    implausible: int = 0


class SampleWatch:
    """Knows since when the displacement has come without a break, and what to do with its next sample.

    `first` and `last` are the stamps (ns) between which it came so, None before the first sample.
    """

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        self.measured_before = False
        """Whether the measurements are known to have come without a break before the first sample, too."""
        self._broken = False  # whether `first` came after a break that was heard
        self.interrupted = False  # since the activation
        self.foreign = ''  # which other sender there is, since the activation
        self.nameless = False  # whether `foreign` only tells what came, not from whom
        self.writer_doubt = ''  # which other sender there may be at present
        self.counts = SampleCounts()
        self._intruded: deque[int] = deque(maxlen=_INTRUSIONS)  # stamps of samples that came too soon, ns
        self._used: int | None = None  # stamp of the last sample that the controller took, ns
        self._activation = 0  # ns
        self._longest_bridge = 0  # ns
        self._range = 0.0  # m
        self._period = SAMPLE_TIME_NS  # ns between two samples
        self._closest = round(_CLOSEST * SAMPLE_TIME_NS)
        self._steps: deque[int] = deque(maxlen=_LOOKED_BACK)  # ns, between the last samples
        self._seen: int | None = None  # stamp of the last sample that was compared with those before, ns
        self.plausibility = Plausibility(ControlParameters())

    def note(self, stamp: int) -> None:
        """Take the stamp (ns) of a sample; one that comes a little too late changes nothing."""
        if self.last is None:
            self.first, self.last = 0 if self.measured_before else stamp, stamp
        elif abs(stamp - self.last) > _STREAM_BREAK:
            self.first = self.last = stamp
            self._broken = True
            self._steps.clear()
        elif stamp > self.last:
            self._steps.append(stamp - self.last)
            self.last = stamp

    def check_belongs(self, table_stamp: int | None, air_gap_stamp: int | None) -> None:
        """Raise `ForceTableError` unless the table was measured on the present uninterrupted measurements.

        Pads wear and the car is assembled anew, so a table from before a loss of power is not valid.
        """
        remedy = 'activate mount_init (again)'
        if table_stamp is None or air_gap_stamp is None:
            missing = 'current_force_table' if table_stamp is None else 'air_gap'
            raise ForceTableError(f'no {missing} was received (0 messages, needed is 1); {remedy}')
        if table_stamp != air_gap_stamp:
            raise ForceTableError(
                f'current_force_table (activation {_seconds(table_stamp)}) and air_gap '
                f'(activation {_seconds(air_gap_stamp)}) are of different activations; {remedy}'
            )
        if self.first is None or self.last is None:
            raise ForceTableError('no displacement was received; activate mount_driver first')
        if table_stamp < self.first:
            raise ForceTableError(
                f'current_force_table is of {_seconds(table_stamp)}, but {self._since(self.first)}; {remedy}'
            )
        if table_stamp > self.last:
            raise ForceTableError(
                f'current_force_table is of {_seconds(table_stamp)}, but the newest displacement is of '
                f'{_seconds(self.last)}: the time of the measurements went back, or they stand still; '
                f'{remedy}'
            )

    def _since(self, first: int) -> str:
        if self._broken:
            return f'the measurements were interrupted or went back, and came anew at {_seconds(first)}'
        return (
            f'mount_control hears the measurements since {_seconds(first)} only, when it was configured, and '
            'cannot know that they have come without a break since the table'
        )

    def check_rate(self, sample_rate: float) -> None:
        """Raise `ForceTableError` if the last samples were not measured at `sample_rate` (Hz).

        By the lower quartile of the times between them: up to three of four may be lost.
        """
        if len(self._steps) < _COUNTED:
            return
        rate = _NANOSECONDS / sorted(self._steps)[len(self._steps) // 4]
        if abs(rate - sample_rate) > _RATE_TOLERANCE * sample_rate:
            raise ForceTableError(
                f'displacement comes at {rate:.0f} Hz, but sample_rate of mount_control is {sample_rate:g} '
                f'Hz (limit {100.0 * _RATE_TOLERANCE:g} %); start the whole graph with one sample_rate'
            )

    def begin(self, activation: int, parameters: ControlParameters) -> None:
        """Count anew: what comes after `activation` (ns) is to be answered."""
        self._activation = activation
        self._longest_bridge = round(parameters.longest_bridge * _NANOSECONDS)
        self._range = parameters.displacement_range
        self._period = sample_time_ns(parameters.sample_rate)
        self._closest = round(_CLOSEST * self._period)
        self.plausibility = Plausibility(parameters)
        self._used, self._seen, self.interrupted, self.counts = None, None, False, SampleCounts()
        self.foreign, self.nameless = '', False
        self._intruded.clear()

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        """Take which other sender discovery has found, and which there may be; the first name stays."""
        if confirmed and (self.nameless or not self.foreign):
            self.foreign, self.nameless = confirmed, False
        self.writer_doubt = suspected

    def judge(self, stamp: int, displacement: float) -> tuple[Judgement, int]:
        """Return the judgement on a noted sample (ns, m), and how many are missing before it."""
        if self.first is None or self.last is None or not self.first <= self._activation <= self.last:
            self.interrupted = True
        if self.interrupted:
            return Judgement.INTERRUPTED, 0
        if stamp <= self._activation:
            return Judgement.EARLY, 0
        if self._used is not None and stamp - self._used < self._closest:
            self._note_intrusion(stamp)
        if self.foreign or self.writer_doubt:
            return Judgement.FOREIGN, 0
        if self._used is not None and stamp <= self._used:
            self.counts.ignored += 1
            return Judgement.IGNORE, 0
        if not math.fabs(displacement) <= self._range:  # also NaN
            self.counts.invalid += 1
            return Judgement.INVALID, 0
        if self.plausibility.doubt(
            displacement, 0 if self._seen is None else self._missing(stamp - self._seen)
        ):
            self._seen = stamp
            self.counts.implausible += 1
            return Judgement.IMPLAUSIBLE, 0
        self._seen = stamp
        elapsed = self._longest_bridge + 1 if self._used is None else stamp - self._used
        self._used = stamp
        self.counts.samples += 1
        if elapsed > self._longest_bridge:
            self.counts.restarts += 1
            return Judgement.RESTART, 0
        missing = self._missing(elapsed)
        self.counts.bridged += missing
        return Judgement.USE, missing

    def expects(self, stamp: int) -> bool:
        """Whether a believable sample of time `stamp` (ns) just goes on where the last one used ended."""
        return self._used == stamp - self._period

    def following(self, stamps: NDArray[np.int64], displacement: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of the samples (n,) are believable and one period after the one before."""
        valid = np.abs(displacement) <= self._range  # not so for NaN
        follows = np.zeros(len(stamps), bool)
        steps = np.diff(stamps)
        follows[1:] = valid[1:] & (steps >= self._closest) & (steps < self._period + self._period // 2)
        return follows

    def believed(self, stamps: NDArray[np.int64], displacement: NDArray[np.float64]) -> int:
        """Note the samples (n,), which follow each other, up to the first in doubt; return how many."""
        count = self.plausibility.believed(displacement)
        if count:
            self.follow(int(stamps[count - 1]), count)
        return count

    def follow(self, last_stamp: int, count: int) -> None:
        """Note `count` samples that followed each other without a doubt, the last at `last_stamp` (ns).

        They have passed `plausibility`. However long they lasted, nothing was interrupted.
        """
        self.last = self._used = self._seen = last_stamp
        self.counts.samples += count

    def _missing(self, elapsed: int) -> int:
        """Return how many samples are missing between two that are `elapsed` ns apart."""
        return max(0, (elapsed + self._period // 2) // self._period - 1)

    def _note_intrusion(self, stamp: int) -> None:
        found = self._intruded
        found.append(stamp)
        if len(found) == _INTRUSIONS and stamp - found[0] <= _INTRUSION_PERIOD and not self.foreign:
            self.nameless = True
            self.foreign = (
                f'{len(found)} displacement samples within {_INTRUSION_PERIOD * 1e-9:g} s were repeated, '
                f'older than the one before or less than {self._closest * 1e-6:g} ms behind it: end one of '
                'the two nodes that publish displacement'
            )


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.3f} s'
