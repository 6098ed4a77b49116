"""Whether the measured coil current follows the setpoints that were sent: bounds from a model of the loop.

No bus and no clock here: time is counted in samples of the electronics, so neither a late frame nor a driver
that stood still and then takes many samples at once is a deviation of the coil.

Which setpoint the electronics follow at a sample is known only by their contract (`mount.dbc`): one that
answers a sample of the last 20 ms, or none. So two bounds are kept. The upper one rises at once to the
highest of these setpoints and falls as the slowest working loop falls; the lower one mirrors it. 0 A that the
electronics went to by themselves, or that was sent with `Enable` 0, can stand between any two of them: the
lower bound is 0 A for a while behind either, and begins anew behind a lost sample. It only guards the
damping; a current that is too high stays in sight at any load of the machine.
"""

import math
from collections.abc import Iterable
from typing import Annotated, NamedTuple

from mount_driver.can_messages import Measurement, Setpoint
from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME_NS, SETPOINT_TIMEOUT

_UNSURE = 0.5  # s, chosen: so long 0 A may be followed late, or once more
_FORGIVEN = 50  # samples, chosen: of a sound coil one deviates now and then, far more seldom (measured)
_COUNTER_MASK = 0xFFFF


class CoilWatchParameters(NamedTuple):
    """How far the measured coil current may lie from where the setpoints put it, and how long."""

    limit: Annotated[float, Quantity('A', 'greatest deviation of the coil current', 0.02, 1.0)] = 0.1
    duration: Annotated[
        float, Quantity('s', 'a deviation that lasts so long takes the coil to 0 A', 0.002, 0.1)
    ] = 0.020
    bandwidth: Annotated[
        float, Quantity('Hz', "bandwidth of the electronics' current loop", 50.0, 2000.0)
    ] = 400.0
    rise_rate: Annotated[
        float, Quantity('A/s', 'slowest rise of a working coil at low supply', 10.0, 1000.0)
    ] = 50.0
    fall_rate: Annotated[
        float, Quantity('A/s', 'slowest fall of a working coil at low supply', 10.0, 1000.0)
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
        self._sure_from = 0
        self._deviating = 0  # samples, less one for each `_FORGIVEN` that fitted
        self._fitting = 0

    def judge(self, sample: Measurement, sent: Iterable[Setpoint] = ()) -> str:
        """Return why the coil is not under control, empty while it is or while that is not certain.

        Each sample comes once, in order, with the setpoints `sent` since the one before. Electronics that say
        to be off must carry no current. A current that is not valid (NaN) is a deviation as soon as one is
        wanted.
        """
        # In one piece, as it runs for every sample. First what the setpoints lie between, sample by sample.
        off = sample.setpoint_timeout or not sample.enabled
        unsure, lows, highs, last, followed = off, self._lows, self._highs, self._number, self._followed
        for setpoint in sent:
            unsure = unsure or not setpoint.enable
            age = (last - setpoint.answered_counter) & _COUNTER_MASK
            if setpoint.enable and age < followed:  # else the electronics do not use it
                place = (last - age) % followed
                lows[place] = min(lows[place], setpoint.current)
                highs[place] = max(highs[place], setpoint.current)
        # What answered the oldest samples is forgotten, and nothing answers the new ones yet.
        counter = sample.sample_counter
        self._number = number = last + ((counter - last) & _COUNTER_MASK) if last >= 0 else counter
        lost = number - last - 1 if last >= 0 else 0
        for each in range(number - min(lost, followed), number + 1):
            lows[each % followed], highs[each % followed] = math.inf, 0.0
        if unsure:
            self._sure_from = number + self._unsure
        # The upper bound, then the lower one, which begins at 0 A where samples were lost.
        wanted, low = max(highs), min(lows)
        high = 0.0 if off else wanted
        fall = self._share * (self._high - high)  # negative where the bound lies below: then it goes there
        self._high = high if fall <= 0.0 else self._high - (fall if fall < self._fall else self._fall)
        before = 0.0 if lost else self._low
        rise = self._share * (low - before)
        if low > high or number < self._sure_from:
            self._low = 0.0
        else:
            self._low = low if rise <= 0.0 else before + (rise if rise < self._rise else self._rise)
        current = sample.coil_current
        within = self._low - self._limit <= current <= self._high + self._limit  # not so for NaN
        if within or (current != current and wanted == 0.0):
            # Many that fit make up for one that deviated: a coil that is stuck fits now and then too.
            if self._deviating:
                self._fitting += 1
                if self._fitting == _FORGIVEN:
                    self._fitting = 0
                    self._deviating -= 1
            return ''
        self._deviating += 1
        return self._sentence(current) if self._deviating > self._duration else ''

    def _sentence(self, current: float) -> str:
        measured = f'{current:.3f} A' if current == current else 'not valid'
        low, high = max(0.0, self._low - self._limit), self._high + self._limit
        lasted = 1e3 * self._period * (self._deviating - 1)
        return (
            f'coil current ({measured}) must lie within {low:.3f} .. {high:.3f} A, {self._limit:g} A about '
            f'its setpoint; it has not for {lasted:.0f} ms in all: check supply, coil, cable and power stage'
        )
