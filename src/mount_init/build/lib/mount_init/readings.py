"""The ripple samples of one ramp, by sample number, and whether they can be those of a working coil."""

import math

import numpy as np
import numpy.typing as npt

from mount_init.errors import TooFewRipplesError, UnusableReadingsError
from mount_init.parameters import InitParameters
from mount_init.ramp import Ramp
from mount_models.coil.gap import measured_inductance

FloatArray = npt.NDArray[np.float64]
_RATE_TOLERANCE = 0.2  # chosen: less than any other rate lies beside, more than losses in a ramp
BoolArray = npt.NDArray[np.bool_]


class Readings:
    """Current (A), slopes of current (A/s) and flux density (T/s), by sample number; NaN where invalid."""

    def __init__(self, count: int):
        self._rows = np.full((3, count), np.nan)
        self.received = 0
        self.skipped = 0

    @property
    def valid(self) -> int:
        """Number of samples received with all three readings finite."""
        return self.received - self.skipped

    def forget(self, number: int) -> None:
        """Take back the samples from `number` on."""
        self.skipped -= int(np.isnan(self._rows[0, number : self.received]).sum())
        self._rows[:, number:] = np.nan
        self.received = number

    def add(self, current: float, current_rate: float, flux_rate: float) -> bool:
        """Store the next sample; return whether it is valid. What is not finite is skipped and counted."""
        number = self.received
        self.received += 1
        if not (math.isfinite(current) and math.isfinite(current_rate) and math.isfinite(flux_rate)):
            self.skipped += 1
            return False
        self._rows[:, number] = current, current_rate, flux_rate
        return True

    @property
    def current(self) -> FloatArray:
        """Mean current of each ripple, A, shape (N,)."""
        return self._rows[0]

    @property
    def current_rate(self) -> FloatArray:
        """Slope of the current after switching, A/s, shape (N,)."""
        return self._rows[1]

    @property
    def flux_rate(self) -> FloatArray:
        """Slope of the flux density after switching, T/s, shape (N,)."""
        return self._rows[2]

    def inductance(self, turns_area: float) -> FloatArray:
        """Return L_i = n A (dB/dt) / (di/dt) (H), Eq (5) upright; NaN where a slope is not positive."""
        current_rate = np.where(self.current_rate > 0.0, self.current_rate, np.nan)
        flux_rate = np.where(self.flux_rate > 0.0, self.flux_rate, np.nan)
        return measured_inductance(turns_area, flux_rate, current_rate)


def check_rate(duration: int, count: int, parameters: InitParameters) -> None:
    """Raise `UnusableReadingsError` unless the `count` samples of a ramp took the right time (ns)."""
    rate = 1e9 * (count - 1) / max(1, duration)
    if abs(rate - parameters.sample_rate) > _RATE_TOLERANCE * parameters.sample_rate:
        raise UnusableReadingsError(
            f'coil_ripple came at {rate:.0f} Hz, but sample_rate of mount_init is {parameters.sample_rate:g} '
            f'Hz (limit {100.0 * _RATE_TOLERANCE:g} %); start the whole graph with one sample_rate'
        )


def check_readings(readings: Readings, ramp: Ramp, parameters: InitParameters) -> None:
    """Raise `TooFewRipplesError` or `UnusableReadingsError` unless the whole ramp has good readings."""
    _check_count(readings, ramp, parameters)
    _check_signs(readings, parameters)
    _check_alive(readings, ramp, parameters)


def _check_count(readings: Readings, ramp: Ramp, parameters: InitParameters) -> None:
    finite = np.isfinite(readings.current)
    for part in ('dwell_before', 'up', 'down', 'dwell_after'):
        inside = finite[getattr(ramp, part)]
        needed = math.ceil(parameters.valid_share * inside.size)
        found = int(inside.sum())
        if found < needed:
            raise TooFewRipplesError(
                f'air gap not estimated: {found} of {inside.size} ripple samples valid in the part '
                f'"{part.replace("_", " ")}", needed are {needed}; check the coil ripple measurement'
            )


def _check_signs(readings: Readings, parameters: InitParameters) -> None:
    for name, unit, rate in (
        ('slope of the coil current', 'A/s', readings.current_rate),
        ('slope of the flux density', 'T/s', readings.flux_rate),
    ):
        rate = rate[np.isfinite(rate)]
        wrong = rate[rate <= 0.0]
        if wrong.size > parameters.rejected_share * rate.size:
            raise UnusableReadingsError(
                f'{name} after switching to plus must be positive; {wrong.size} of {rate.size} samples are '
                f'not, such as {wrong[0]:g} {unit}: check the polarity of the coil and of its sensors'
            )


def _check_alive(readings: Readings, ramp: Ramp, parameters: InitParameters) -> None:
    longest = max(2, round(parameters.stuck_duration * parameters.sample_rate))
    for name, unit, values in (
        ('coil current', 'A', readings.current),
        ('slope of the coil current', 'A/s', readings.current_rate),
        ('slope of the flux density', 'T/s', readings.flux_rate),
    ):
        for part in (ramp.up, ramp.down):
            length, value = _longest_constant_run(values[part])
            if length > longest:
                raise UnusableReadingsError(
                    f'{name} stayed at {value:g} {unit} for {length} samples while the current was ramped, '
                    f'more than {longest}; the sensor is stuck: check it and its connection'
                )


def _longest_constant_run(values: FloatArray) -> tuple[int, float]:
    """Return length and value of the longest run of identical values; NaN is left out."""
    values = values[np.isfinite(values)]
    starts = (
        np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]])) if values.size else np.zeros(0)
    )
    if not starts.size:
        return 0, math.nan
    lengths = np.diff(np.append(starts, values.size))
    longest = int(np.argmax(lengths))
    return int(lengths[longest]), float(values[starts[longest]])
