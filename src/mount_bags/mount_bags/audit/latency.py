"""How long an answer takes: from the stamp of a sample to the arrival of its setpoint at the recorder."""

from dataclasses import dataclass

import numpy as np

from mount_bags.messages.series import Times

EDGES = (0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 20e-3)  # s, chosen
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer


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
    if stamps.size < 2:
        return None
    latencies = receive_times - stamps
    stamped = int(stamps.max()) - int(stamps.min())
    received = int(receive_times.max()) - int(receive_times.min())
    if np.abs(np.median(latencies)) > _SAME_CLOCK:
        return None
    if stamped > 1_000_000_000 and abs(received / stamped - 1.0) > _SAME_PACE:
        return None
    seconds = latencies * 1e-9
    places = np.searchsorted(EDGES, seconds, side='right')
    return Latency(
        counts=tuple(np.bincount(places, minlength=len(EDGES) + 1).tolist()),
        median=float(np.median(seconds)),
        p99=float(np.quantile(seconds, 0.99)),
        worst=float(seconds.max()),
    )
