"""The ramp by sample number: the current that is set, and the ripple that is read.

Rest current, smooth ramp to the peak, and the same way back to 0 A.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_init.errors import InitialisationError
from mount_init.parameters import InitParameters
from mount_models.coil.gap import measured_inductance

FloatArray = npt.NDArray[np.float64]


class Ramp(NamedTuple):
    """Setpoints (A), shape (N,), one per ripple sample, and the sample numbers of its parts.

    The dwells leave out the time in which the halves settle.
    """

    setpoints: FloatArray
    dwell_before: slice
    up: slice
    down: slice
    dwell_after: slice


def current_ramp(parameters: InitParameters, rest_current: float) -> Ramp:
    """Return the ramp 0 A -> `rest_current` (A) -> peak -> `rest_current` -> 0 A; its last setpoint is 0 A.

    Each change is a smooth step 3 s^2 - 2 s^3, so the steepest slope is 1.5 times the mean one: 6 A/s with
    the default values, of some 140 A/s that 14 V allow at low current.
    """
    if not 0.0 < rest_current < parameters.peak_current:
        raise InitialisationError(
            f'rest current of the specimen ({rest_current:.3f} A) must lie between 0 A and peak_current '
            f'({parameters.peak_current:.3f} A); check the specimen'
        )
    if not parameters.settle_duration < parameters.dwell_duration:
        raise InitialisationError(
            f'settle_duration ({parameters.settle_duration:g} s) must lie below dwell_duration '
            f'({parameters.dwell_duration:g} s); otherwise no sample of the dwell is used'
        )
    settle = _count(parameters, parameters.settle_duration)
    to_rest = rest_current * _smooth_step(_count(parameters, parameters.rise_duration))
    step = _smooth_step(_count(parameters, parameters.ramp_duration))
    to_peak = rest_current + (parameters.peak_current - rest_current) * step
    dwell = np.full(_count(parameters, parameters.dwell_duration), rest_current)
    peak = np.full(_count(parameters, parameters.peak_duration), parameters.peak_current)
    tail = np.zeros(max(1, _count(parameters, parameters.tail_duration)))
    pieces = [to_rest, dwell, to_peak, peak, to_peak[::-1], dwell, to_rest[::-1], tail]
    start = [0, *np.cumsum([piece.size for piece in pieces]).tolist()]
    return Ramp(
        setpoints=np.concatenate(pieces),
        dwell_before=slice(start[1] + settle, start[2]),
        up=slice(start[2], start[3]),
        down=slice(start[4], start[5]),
        dwell_after=slice(start[5] + settle, start[6]),
    )


class Readings:
    """Current (A), slopes of current (A/s) and flux density (T/s), by sample number; NaN where invalid."""

    def __init__(self, count: int):
        self._rows = np.full((3, count), np.nan)
        self.current, self.current_rate, self.flux_rate = self._rows
        self.received = 0
        self.skipped = 0

    @property
    def valid(self) -> int:
        """Number of samples received with all three readings finite."""
        return self.received - self.skipped

    def add(self, *sample: float) -> bool:
        """Store the next sample; return whether it is valid. What is not finite is skipped and counted."""
        valid = all(math.isfinite(number) for number in sample)
        if valid:
            self._rows[:, self.received] = sample
        self.received += 1
        self.skipped += not valid
        return valid

    def inductance(self, turns_area: float) -> FloatArray:
        """Return L_i = n A (dB/dt) / (di/dt) (H), Eq (5) upright; NaN where a slope is not positive."""
        current_rate = np.where(self.current_rate > 0.0, self.current_rate, np.nan)
        flux_rate = np.where(self.flux_rate > 0.0, self.flux_rate, np.nan)
        return measured_inductance(turns_area, flux_rate, current_rate)


def _count(parameters: InitParameters, duration: float) -> int:
    return round(duration * parameters.sample_rate)


def _smooth_step(count: int) -> FloatArray:
    share = (np.arange(count) + 0.5) / count
    return share * share * (3.0 - 2.0 * share)
