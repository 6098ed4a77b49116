"""Whether the measured coil current follows the setpoints that were sent: bounds from a model of the loop.

No bus and no clock here: times are ns by the clock that judges ages (`Clock.now`).

The electronics take a setpoint over at their next sample and their current loop, a first-order lag within
what the supply allows, follows. Which setpoint they follow at a sample is known only within a window: from
the longest way of a frame before the sample was taken to now. So two bounds are kept. The upper one rises
at once to the highest setpoint of the window and falls as the slowest working loop falls; the lower one the
other way round. A working coil stays between them at any load of the machine, which only widens the window.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME_NS, SETPOINT_TIMEOUT

_ON_THE_BUS = 3_000_000  # ns, chosen
_LATEST = 50_000_000  # ns, chosen: no sample is believed to have waited longer than this
_REMEMBERED = 128  # chosen: setpoints; more than are sent in `_LATEST` and the way of a frame, at 2 kHz too
_HOLD = round(1e9 * SETPOINT_TIMEOUT)  # ns: after a longer pause the electronics may have gone to 0 A


class CoilWatchParameters(NamedTuple):
    """How far the measured coil current may lie from where the setpoints put it, and how long."""

    limit: Annotated[float, Quantity('A', 'greatest deviation of the coil current', 0.02, 1.0, 'chosen')] = (
        0.1
    )
    duration: Annotated[
        float, Quantity('s', 'a deviation that lasts so long takes the coil to 0 A', 0.002, 0.1, 'chosen')
    ] = 0.020
    bandwidth: Annotated[
        float, Quantity('Hz', "bandwidth of the electronics' current loop", 50.0, 2000.0, 'chosen')
    ] = 400.0
    rise_rate: Annotated[
        float, Quantity('A/s', 'slowest rise of a working coil at low supply', 10.0, 1000.0, 'chosen')
    ] = 50.0
    fall_rate: Annotated[
        float, Quantity('A/s', 'slowest fall of a working coil at low supply', 10.0, 1000.0, 'chosen')
    ] = 150.0


class CoilWatch:
    """Takes what was sent and what was measured, sample by sample."""

    def __init__(self, parameters: CoilWatchParameters, sample_time: int = SAMPLE_TIME_NS):
        """`sample_time` in ns."""
        self._way = sample_time + _ON_THE_BUS  # ns: to the electronics' next sample
        self._limit = parameters.limit
        self._duration = round(1e9 * parameters.duration)
        self._bandwidth = 2e-9 * math.pi * parameters.bandwidth  # 1/ns
        self._rise, self._fall = 1e-9 * parameters.rise_rate, 1e-9 * parameters.fall_rate  # A/ns
        self._sent: list[tuple[float, float]] = [(-math.inf, 0.0)] * _REMEMBERED  # time, current
        self._newest = 0
        self._low, self._high = 0.0, HIGHEST_CURRENT  # what ran before is not known
        self._judged: int | None = None
        self._deviates_since: int | None = None

    def note_sent(self, current: float, now: int) -> None:
        """Take a setpoint (A; 0 with `Enable` 0) that leaves at `now`; one thread at a time."""
        newest = (self._newest + 1) % _REMEMBERED
        self._sent[newest] = now, current
        self._newest = newest

    def judge(self, current: float, enabled: bool, taken: int, now: int) -> str:
        """Return why the coil is not under control, empty while it is or while that is not certain.

        `current` (A) was measured at `taken` and arrived at `now`; `enabled`: the electronics say that their
        power stage is on. One that they say to be off must carry no current. A current that is not valid
        (NaN) is a deviation as soon as one is wanted.
        """
        begin = max(taken, now - _LATEST) - self._way
        low, high = self._window(begin) if enabled else (0.0, 0.0)
        self._follow(low, high, now)
        within = self._low - self._limit <= current <= self._high + self._limit  # not so for NaN
        unwanted = current != current and self._window(begin)[1] == 0.0
        if within or unwanted:
            self._deviates_since = None
            return ''
        if self._deviates_since is None:
            self._deviates_since = now
        if now - self._deviates_since < self._duration:
            return ''
        return self._sentence(current, now - self._deviates_since)

    def _window(self, begin: int) -> tuple[float, float]:
        """Return the least and the highest setpoint that the electronics can have followed since `begin`."""
        sent, place = self._sent, self._newest
        time, low = sent[place]
        high = low
        for _ in range(_REMEMBERED - 1):
            if time <= begin:
                break
            place -= 1
            time, current = sent[place]
            if current < low:
                low = current
            elif current > high:
                high = current
        return low, high

    def _follow(self, low: float, high: float, now: int) -> None:
        elapsed = 0 if self._judged is None else now - self._judged
        self._judged = now
        step = self._bandwidth * elapsed
        share = step / (1.0 + step)  # less than the exact 1 - exp(-step), which makes the bounds wider
        risen = self._low + min(share * (low - self._low), self._rise * elapsed)
        self._low = min(low, risen) if elapsed <= _HOLD else 0.0
        self._high = max(high, self._high - min(share * (self._high - high), self._fall * elapsed))

    def _sentence(self, current: float, lasted: int) -> str:
        measured = f'{current:.3f} A' if current == current else 'not valid'
        low, high = max(0.0, self._low - self._limit), self._high + self._limit
        return (
            f'coil current ({measured}) must lie within {low:.3f} .. {high:.3f} A, {self._limit:g} A about '
            f'its setpoint; it has not for {1e-6 * lasted:.0f} ms: check coil, cable and power stage'
        )
