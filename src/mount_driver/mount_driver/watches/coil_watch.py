"""Whether the measured coil current follows the setpoints that were sent: bounds from a model of the loop.

No bus and no clock here: time is counted in samples of the electronics, so neither a late frame nor a driver
that stood still and then takes many samples at once looks like a coil at fault.

Which setpoint the electronics follow at a sample is known only by their contract (`mount.dbc`): one that
answers a sample of the last 20 ms, or none. So two bounds are kept. The upper one rises at once to the
highest of these setpoints and falls as the slowest working loop falls; the lower one mirrors it. 0 A that the
electronics went to by themselves, or that was sent with `Enable` 0, can stand between any two of them: the
lower bound is 0 A for a while behind either, and begins anew behind a lost sample. It only guards the
damping; a current that is too high stays in sight at any load of the machine.
"""

import math
from typing import Annotated, NamedTuple

from mount_driver.codec import Measurement, Setpoint
from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME_NS, SETPOINT_TIMEOUT

_UNSURE = 0.5  # s, chosen: so long 0 A may be followed late, or once more
_FORGIVEN = 50  # samples, chosen: of a sound coil one deviates now and then, far more seldom (measured)
_COUNTER_MASK = 0xFFFF


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
        period = 1e-9 * sample_time
        # A setpoint in force answers a sample of the hold; one more to take it over, and one to see it.
        self._followed = round(SETPOINT_TIMEOUT / period) + 2
        self._unsure = round(_UNSURE / period)  # samples
        self._limit = parameters.limit
        self._duration = round(parameters.duration / period)  # samples
        self._period = period
        closed = 2.0 * math.pi * parameters.bandwidth * period
        self._share = closed / (1.0 + closed)  # less than the exact 1 - exp(-closed): the bounds are wider
        self._rise, self._fall = parameters.rise_rate * period, parameters.fall_rate * period  # A
        # What the setpoints lie between that answer each of the last samples; what ran before is not known.
        self._lows, self._highs = [0.0] * self._followed, [HIGHEST_CURRENT] * self._followed
        self._low, self._high = 0.0, HIGHEST_CURRENT
        self._number = -1  # of the last sample: its counter, unwrapped
        self._off_sent = False
        self._sure_from = 0
        self._deviating = 0  # samples, less one for each `_FORGIVEN` that fitted
        self._fitting = 0

    def note_sent(self, setpoint: Setpoint) -> None:
        """Take a setpoint that leaves; one thread at a time, which need not be that of `judge`."""
        if not setpoint.enable:
            self._off_sent = True
            return
        newest = self._number  # once: the other thread counts on
        age = (newest - setpoint.answered_counter) & _COUNTER_MASK
        if age >= self._followed:
            return  # nor do the electronics use it
        place = (newest - age) % self._followed
        current = setpoint.current
        if current < self._lows[place]:
            self._lows[place] = current
        if current > self._highs[place]:
            self._highs[place] = current

    def judge(self, sample: Measurement) -> str:
        """Return why the coil is not under control, empty while it is or while that is not certain.

        Each sample comes once, in order. Electronics that say to be off must carry no current. A current that
        is not valid (NaN) is a deviation as soon as one is wanted.
        """
        lost = self._count(sample.sample_counter)
        off = sample.setpoint_timeout or not sample.enabled
        if off or self._off_sent:
            self._off_sent = False
            self._sure_from = self._number + self._unsure
        wanted = max(self._highs)
        self._follow(0.0 if off else wanted, lost)
        current = sample.coil_current
        within = self._low - self._limit <= current <= self._high + self._limit  # not so for NaN
        if within or (current != current and wanted == 0.0):
            self._forgive()
            return ''
        self._deviating += 1
        return self._sentence(current) if self._deviating > self._duration else ''

    def _forgive(self) -> None:
        """Forget a sample that deviated for many that fit: a coil that is stuck fits now and then too."""
        if self._deviating:
            self._fitting += 1
            if self._fitting == _FORGIVEN:
                self._fitting = 0
                self._deviating -= 1

    def _count(self, counter: int) -> int:
        """Return how many samples were lost; forget what answered the oldest, nothing answers the new yet."""
        last = self._number
        self._number = number = last + ((counter - last) & _COUNTER_MASK) if last >= 0 else counter
        lost = number - last - 1 if last >= 0 else 0
        for each in range(number - min(lost, self._followed), number + 1):
            place = each % self._followed
            self._lows[place], self._highs[place] = math.inf, 0.0
        return lost

    def _follow(self, high: float, lost: int) -> None:
        """Move the bounds on by a sample, the lower one from 0 A where samples were `lost`."""
        gap = self._high - high
        if gap > 0.0:
            fall = self._share * gap
            self._high -= fall if fall < self._fall else self._fall
        else:
            self._high = high
        low = min(self._lows)
        if low > high or self._number < self._sure_from:
            self._low = 0.0
            return
        before = 0.0 if lost else self._low
        rise = self._share * (low - before)  # negative where the bound lies above: then it goes there at once
        self._low = low if rise <= 0.0 else before + (rise if rise < self._rise else self._rise)

    def _sentence(self, current: float) -> str:
        measured = f'{current:.3f} A' if current == current else 'not valid'
        low, high = max(0.0, self._low - self._limit), self._high + self._limit
        lasted = 1e3 * self._period * (self._deviating - 1)
        return (
            f'coil current ({measured}) must lie within {low:.3f} .. {high:.3f} A, {self._limit:g} A about '
            f'its setpoint; it has not for {lasted:.0f} ms in all: check supply, coil, cable and power stage'
        )
