"""The coil temperature of an initialisation: as measured, else as given, else unknown.

The stamps alone decide which reading counts, so that a recording of the same readings gives the same result.
"""

import math
from collections import deque
from enum import Enum
from typing import NamedTuple

_LONGEST_AGE = 5_000_000_000  # ns, chosen: at 3 A the coil warms by a few kelvin in it, worth some um
_KEPT = 256  # readings, chosen: at 10 Hz those of the longest ramp


class TemperatureSource(Enum):
    """Where the temperature of an initialisation comes from."""

    MEASURED = 'measured'
    PARAMETER = 'parameter'
    UNKNOWN = 'unknown'


class CoilTemperature(NamedTuple):
    """A coil temperature in degC, NaN where it is unknown, and its source."""

    celsius: float = math.nan
    source: TemperatureSource = TemperatureSource.UNKNOWN


class TemperatureReadings:
    """The newest readings of the present measurement stream; one thread may take while another asks."""

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
    if not math.isnan(measured):
        return CoilTemperature(measured, TemperatureSource.MEASURED)
    if not math.isnan(given):
        return CoilTemperature(given, TemperatureSource.PARAMETER)
    return CoilTemperature()
