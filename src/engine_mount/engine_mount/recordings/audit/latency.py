"""How long an answer takes: from the stamp of a sample to the arrival of its setpoint at the recorder."""

from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.messages.times import Times

EDGES = (0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 20e-3)  # s, chosen
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer
_ANY_CLOCK = 1 << 62  # ns, 146 years: differences beyond it do not fit into 64 bits


@dataclass(frozen=True)
class Latency:
    """Latencies in s; `counts` has one number below `EDGES`, one for each step of it, and one above."""

    counts: tuple[int, ...]
    median: float
    p99: float
    worst: float


def setpoint_latency(stamps: Times, receive_times: Times) -> Latency | None:
    """Return the latencies of setpoints, None where their stamps are not of the clock of reception.

    In lock-step the stamps count the time of the simulation. All times are in ns.
    """
    if not on_one_clock(stamps, receive_times):
        return None
    ages = (receive_times - stamps) * 1e-9
    counts = np.bincount(np.searchsorted(EDGES, ages, side='right'), minlength=len(EDGES) + 1)
    return Latency(
        tuple(counts.tolist()), float(np.median(ages)), float(np.quantile(ages, 0.99)), float(ages.max())
    )


def on_one_clock(stamps: Times, times: Times) -> bool:
    """Return whether the stamps of setpoints are on the clock of `times`, when they were sent or came."""
    if len(stamps) < 2:
        return False
    ages = times - stamps
    if int(ages.max()) - int(ages.min()) > _ANY_CLOCK or abs(float(np.median(ages))) > _SAME_CLOCK:
        return False
    stamped, timed = int(np.ptp(stamps)), int(np.ptp(times))
    return not (stamped > 1_000_000_000 and abs(timed / stamped - 1.0) > _SAME_PACE)
