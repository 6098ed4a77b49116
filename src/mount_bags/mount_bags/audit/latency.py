"""How long an answer takes: from the stamp of a sample to the arrival of its setpoint at the recorder."""

from dataclasses import dataclass

import numpy as np

from mount_bags.messages.compact_times import CompactTimes, Times

EDGES = (0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 20e-3)  # s, chosen
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_PIECE = 1 << 16  # setpoints that are looked at together, chosen
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer


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
    seconds = _ages(stamps, receive_times) * 1e-9
    counts = np.zeros(len(EDGES) + 1, np.int64)
    for begin in range(0, len(seconds), _PIECE):
        places = np.searchsorted(EDGES, seconds[begin : begin + _PIECE], side='right')
        counts += np.bincount(places, minlength=len(counts))
    return Latency(
        counts=tuple(counts.tolist()),
        median=float(np.median(seconds, overwrite_input=True)),
        p99=float(np.quantile(seconds, 0.99, overwrite_input=True)),
        worst=float(seconds.max()),
    )


def on_one_clock(stamps: CompactTimes, times: CompactTimes) -> bool:
    """Return whether the stamps of setpoints are on the clock of `times`, when they were sent or came."""
    if len(stamps) < 2:
        return False
    if np.abs(np.median(_ages(stamps, times), overwrite_input=True)) > _SAME_CLOCK:
        return False
    stamped, timed = stamps.highest - stamps.least, times.highest - times.least
    return not (stamped > 1_000_000_000 and abs(timed / stamped - 1.0) > _SAME_PACE)


def _ages(stamps: CompactTimes, times: CompactTimes) -> Times:
    ages, end = np.empty(len(stamps), np.int64), 0
    for stamped, timed in zip(stamps.blocks(), times.blocks(), strict=True):
        begin, end = end, end + len(stamped)
        np.subtract(timed, stamped, out=ages[begin:end])
    return ages
