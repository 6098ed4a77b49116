"""How long an answer takes: from the stamp of a sample to the arrival of its setpoint at the recorder."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.messages.compact_times import CompactTimes, Times

EDGES = (0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 20e-3)  # s, chosen
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer
_ANY_CLOCK = 1 << 62  # ns, 146 years: differences beyond it do not fit into 64 bits
_PLACES = 1 << 16  # chosen: into so many steps of equal width ages are counted at once


@dataclass(frozen=True)
class Latency:
    """Latencies in s; `counts` has one number below `EDGES`, one for each step of it, and one above."""

    counts: tuple[int, ...]
    median: float
    p99: float
    worst: float


def setpoint_latency(stamps: CompactTimes, receive_times: CompactTimes) -> Latency | None:
    """Return the latencies of setpoints, None where their stamps are not of the clock of reception.

    In lock-step the stamps count the time of the simulation. All times are in ns.
    """
    if not on_one_clock(stamps, receive_times):
        return None
    ages = _Ages(stamps, receive_times)
    counts = np.zeros(len(EDGES) + 1, np.int64)
    for block in ages.blocks():
        places = np.searchsorted(EDGES, block * 1e-9, side='right')
        counts += np.bincount(places, minlength=len(counts))
    return Latency(
        counts=tuple(counts.tolist()),
        median=float(np.median(ages.around(0.5)[0] * 1e-9)),
        p99=_between(*ages.around(0.99)),
        worst=ages.highest * 1e-9,
    )


def on_one_clock(stamps: CompactTimes, times: CompactTimes) -> bool:
    """Return whether the stamps of setpoints are on the clock of `times`, when they were sent or came."""
    if len(stamps) < 2:
        return False
    ages = _Ages(stamps, times)
    if ages.highest - ages.least > _ANY_CLOCK or abs(float(np.median(ages.around(0.5)[0]))) > _SAME_CLOCK:
        return False
    stamped, timed = stamps.highest - stamps.least, times.highest - times.least
    return not (stamped > 1_000_000_000 and abs(timed / stamped - 1.0) > _SAME_PACE)


class _Ages:
    """What times are above stamps (ns), in any order; of a long recording they are not held all at once."""

    def __init__(self, stamps: CompactTimes, times: CompactTimes):
        self._stamps, self._times, self._count = stamps, times, len(stamps)
        ends = [(int(block.min()), int(block.max())) for block in self.blocks()]
        self.least, self.highest = min(least for least, _ in ends), max(highest for _, highest in ends)

    def blocks(self) -> Iterator[Times]:
        pairs = zip(self._stamps.blocks(), self._times.blocks(), strict=True)
        return (timed - stamped for stamped, timed in pairs)

    def around(self, share: float) -> tuple[Times, float]:
        """Return the two ages between which a quantile lies, and how far it is from the first to the second.

        Where an age itself is that quantile, it is returned twice.
        """
        place = share * (self._count - 1)
        number = int(place)
        return np.array([self._at(number), self._at(number + (place > number))]), place - number

    def _at(self, number: int) -> int:
        """Return the age that would have this number, from 0, if they were sorted."""
        least, width = self.least, self.highest - self.least + 1
        while width > 1:
            end, width = least + width, -(-width // _PLACES)
            counts = np.zeros(_PLACES, np.int64)
            for block in self.blocks():
                inside = block[(block >= least) & (block < end)]
                counts += np.bincount((inside - least) // width, minlength=_PLACES)
            reached = np.cumsum(counts)
            place = int(np.searchsorted(reached, number, side='right'))
            number -= int(reached[place] - counts[place])
            least += place * width
        return least


def _between(ages: Times, share: float) -> float:
    """Return the age (s) that is `share` of the way from the first of two ages (ns) to the second."""
    return float(np.quantile(ages * 1e-9, share))
