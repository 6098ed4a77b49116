"""From ripple inductances to air gaps (section 3.2), with standard deviations from the measured scatter.

The coil temperature is that which was measured, else that of the parameter, else unknown. The stamps alone
decide which reading counts, so that a recording of the same readings gives the same result.

Robustness: in a dwell, readings farther from the median than 4 scaled median deviations are left out and the
rest averaged; the crossing is a parabola fitted with Tukey's bisquare weights (`mount_models.coil.crossing`).
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mount_init.errors import InitialisationError
from mount_init.parameters import InitParameters
from mount_init.ramp import FloatArray
from mount_init.supply import crossing_at_curves, inductance_at_curves
from mount_models.actuator import checked_force, zero_current_rest_gap
from mount_models.arithmetic.sums import mean, standard_deviation
from mount_models.coil.gap import (
    gap_from_crossing_current,
    gap_per_crossing_current,
    gap_per_inductance,
    rest_gap_from_inductance,
)
from mount_models.quantity import OutsideLawError
from mount_models.specimen import Specimen

_LONGEST_AGE = 5_000_000_000  # ns, chosen: at 3 A the coil warms by a few kelvin in it, worth some um
_KEPT = 256  # readings, chosen: at 10 Hz those of the longest ramp
_MAD_TO_STD = 1.4826  # of a normal distribution
_FARTHEST = 4.0  # chosen: of 500 good readings one in 30 runs is left out
_ROUNDING = 1e-6  # chosen: quantisation of readings without noise is no outlier
_GAP_STEP = 1e-8  # m
_CURRENT_STEP = 1e-5  # A


class CoilTemperature(NamedTuple):
    """A coil temperature in degC, NaN where it is unknown, and its source: measured, parameter or unknown."""

    celsius: float
    source: str


class TemperatureReadings:
    """The newest readings of the present measurement stream; one thread may take while another reads."""

    def __init__(self) -> None:
        self._readings: deque[tuple[int, float]] = deque(maxlen=_KEPT)

    def take(self, stamp: int, celsius: float) -> None:
        """Take a reading (degC) of time `stamp` (ns); NaN is none. Those of a time that started anew go."""
        if math.isnan(celsius):
            return
        if self._readings and stamp < self._readings[-1][0]:
            self._readings.clear()
        self._readings.append((stamp, celsius))

    def at(self, stamp: int) -> float:
        """Return the newest reading (degC) not after `stamp` (ns) and not 5 s before it; NaN without one."""
        for taken, celsius in reversed(tuple(self._readings)):
            if taken <= stamp:
                return celsius if stamp - taken <= _LONGEST_AGE else math.nan
        return math.nan


def coil_temperature(readings: TemperatureReadings, stamp: int | None, given: float) -> CoilTemperature:
    """Return the reading at `stamp` (ns), else the `given` temperature (degC, NaN: none)."""
    measured = readings.at(stamp) if stamp is not None else math.nan
    celsius, source = (given, 'parameter') if math.isnan(measured) else (measured, 'measured')
    return CoilTemperature(celsius, 'unknown' if math.isnan(celsius) else source)


@dataclass(frozen=True)
class RestGap:
    """Gap (m) at the rest current, gap at 0 A, and the standard deviation of the latter."""

    at_rest_current: float
    gap: float
    std: float


@dataclass(frozen=True)
class ContactGap:
    """Gap (m) at the crossing, normal force there (N), gap at zero load and its standard deviation (m)."""

    at_crossing: float
    normal_force_at_crossing: float
    gap: float
    std: float


def dwell_inductance(inductance: FloatArray, parameters: InitParameters) -> tuple[float, float]:
    """Return the mean inductance (H) of one dwell and its standard deviation, outliers left out.

    The standard deviation takes the ripples as independent. Raises `InitialisationError` for many outliers.
    """
    values = inductance[np.isfinite(inductance)]
    median = float(np.median(values))
    deviation = np.abs(values - median)
    scatter = _MAD_TO_STD * float(np.median(deviation))
    good = values[deviation <= max(_FARTHEST * scatter, _ROUNDING * median)]
    rejected = values.size - good.size
    if rejected > parameters.rejected_share * values.size:
        raise InitialisationError(
            f'{rejected} of {values.size} inductances at rest are outliers, more than '
            f'{parameters.rejected_share:.0%}; check the ripple sensors and their cables'
        )
    return mean(good), standard_deviation(good) / math.sqrt(good.size)


def rest_gap(specimen: Specimen, inductance: float, inductance_std: float, celsius: float) -> RestGap:
    """Return the gap at 0 A from the inductance (H) at the rest current; raises `InitialisationError`.

    The inductance is carried back from the coil temperature (degC) to that of the curves, unless that is
    unknown (NaN). The magnet already closes the halves a little at the rest current, so
    d_rest = d + F(i, d) / k_s.
    """
    try:
        inductance = inductance_at_curves(specimen, inductance, celsius)
        at_rest = float(rest_gap_from_inductance(specimen.gap_curves, inductance))
        gap_slope = float(gap_per_inductance(specimen.gap_curves, inductance))
        gap = zero_current_rest_gap(
            specimen.force_law, specimen.spring_stiffness, at_rest, specimen.rest_current
        )
    except OutsideLawError as error:
        raise InitialisationError(
            f'rest gap not estimated (are the halves mounted as calibrated?): {error}'
        ) from error
    closing = _force_per_gap(specimen, specimen.rest_current, at_rest) / specimen.spring_stiffness
    return RestGap(at_rest, gap, abs(gap_slope * (1.0 + closing)) * inductance_std)


def contact_gap(
    specimen: Specimen, rest: RestGap, current: float, current_std: float, celsius: float
) -> ContactGap:
    """Return the gap at which the pads just touch, from the crossing current (A) at a temperature (degC).

    A temperature that is unknown (NaN) is taken for that of the curves.

    At the crossing the pads are compressed by F_N = F(i, d) - k_s (d_rest - d), so d_c = d + F_N / k_p.
    Raises `InitialisationError`. A negative F_N is returned as it is, for `checks` to judge.
    """
    spring, pads = specimen.spring_stiffness, specimen.pad_stiffness
    try:
        at_curves = crossing_at_curves(specimen, current, celsius)
        gap = float(gap_from_crossing_current(specimen.gap_curves, at_curves))
        gap_slope = float(gap_per_crossing_current(specimen.gap_curves, at_curves))
        force = float(checked_force(specimen.force_law, current, gap))
    except OutsideLawError as error:
        raise InitialisationError(
            f'contact gap not estimated (pads worn out, or no rod?): {error}'
        ) from error
    normal_force = force - spring * (rest.gap - gap)
    by_gap = 1.0 + (_force_per_gap(specimen, current, gap) + spring) / pads
    by_current = by_gap * gap_slope + _force_per_current(specimen, current, gap) / pads
    of_current, of_rest = by_current * current_std, spring / pads * rest.std
    std = math.sqrt(of_current * of_current + of_rest * of_rest)
    return ContactGap(gap, normal_force, gap + normal_force / pads, std)


def _slope(law: Callable[[float], float], place: float, step: float, low: float, high: float) -> float:
    """Return the slope of a law about `place` inside its range, from the side that lies inside."""
    begin, end = max(place - step, low), min(place + step, high)
    return (law(end) - law(begin)) / (end - begin)


def _force_per_gap(specimen: Specimen, current: float, gap: float) -> float:
    """Return dF/d(gap) (N/m)."""
    law = specimen.force_law
    return _slope(
        lambda at: float(checked_force(law, current, at)), gap, _GAP_STEP, law.gap_low, law.gap_high
    )


def _force_per_current(specimen: Specimen, current: float, gap: float) -> float:
    law = specimen.force_law
    return _slope(
        lambda at: float(checked_force(law, at, gap)), current, _CURRENT_STEP, 0.0, law.current_high
    )
