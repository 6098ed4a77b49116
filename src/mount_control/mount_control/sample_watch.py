"""Judges each displacement sample before the controller sees it: late, missing, repeated, not believable."""

import math
from dataclasses import dataclass
from enum import Enum

_NANOSECONDS = 1e9


class Judgement(Enum):
    """What to do with a sample."""

    USE = 'use'
    RESTART = 'restart'  # usable, but the past is too far away to be continued
    IGNORE = 'ignore'  # repeated or out of order: already answered
    INVALID = 'invalid'  # NaN or beyond the sensor's range: answered with 0 A


@dataclass
class SampleCounts:
    """What came in since activation."""

    samples: int = 0
    bridged: int = 0
    restarts: int = 0
    ignored: int = 0
    invalid: int = 0


class SampleWatch:
    """Follows the stamps of the samples; knows no clock."""

    def __init__(self, sample_time: float, longest_bridge: float, displacement_range: float):
        self._period = round(sample_time * _NANOSECONDS)
        self._longest = round(longest_bridge * _NANOSECONDS)
        self._range = displacement_range
        self.counts = SampleCounts()
        self.last_stamp: int | None = None

    def judge(self, stamp: int, displacement: float) -> tuple[Judgement, int]:
        """Return the judgement on a sample (stamp ns, displacement m) and how many are missing before it."""
        if self.last_stamp is not None and stamp <= self.last_stamp:
            self.counts.ignored += 1
            return Judgement.IGNORE, 0
        if not math.fabs(displacement) <= self._range:  # also NaN
            self.counts.invalid += 1
            return Judgement.INVALID, 0
        elapsed = self._longest + 1 if self.last_stamp is None else stamp - self.last_stamp
        self.follow(stamp, 1)
        if elapsed > self._longest:
            self.counts.restarts += 1
            return Judgement.RESTART, 0
        missing = max(0, (elapsed + self._period // 2) // self._period - 1)
        self.counts.bridged += missing
        return Judgement.USE, missing

    def follow(self, last_stamp: int, count: int) -> None:
        """Note `count` samples that followed each other without a doubt, the last at `last_stamp` (ns)."""
        self.last_stamp = last_stamp
        self.counts.samples += count
