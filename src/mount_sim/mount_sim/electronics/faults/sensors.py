"""Faults of the displacement sensor and of the ripple measurement."""

import math

from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults.contract import Fault, Occasion
from mount_sim.random_numbers import RandomNumbers

_STEP = 2e-3  # m, chosen
_OUT_OF_RANGE = 0.045  # m, chosen: the signal can carry it, no mount moves so far
_NOISE = 0.3e-3  # m, standard deviation, chosen: 150 times that of a sound sensor
_FAR = 0.6e-3  # m, chosen: its change of sign within 1 ms is 1.2 m/s, and no mount moves faster than 1 m/s
_DRIFT = 1e-3  # m/s, chosen
_RIPPLE_NOISE = 0.2  # 1, standard deviation, chosen: 20 times that of a sound measurement
_RIPPLE_SCALE = 1.3  # 1, chosen


class DisplacementInvalid(Fault):
    """The sensor marks its readings as not valid."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(displacement=math.nan)


class DisplacementStuck(Fault):
    """The sensor repeats the reading with which the fault began."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._stuck = math.nan

    def reading(self, reading: Reading) -> Reading:
        if self._stuck != self._stuck:
            self._stuck = reading.displacement
        return reading._replace(displacement=self._stuck)


class DisplacementStep(Fault):
    """The sensor has slipped."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(displacement=reading.displacement + _STEP)


class DisplacementOutOfRange(Fault):
    """The sensor is at its end, and marks its readings as valid."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(displacement=_OUT_OF_RANGE)


class DisplacementNoisy(Fault):
    """White noise comes in addition."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._random = RandomNumbers(occasion.seed)

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(
            displacement=reading.displacement + _NOISE * float(self._random.normal(1, 1)[0, 0])
        )


class DisplacementInverted(Fault):
    """The sensor has the wrong sign."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(displacement=-reading.displacement)


class DisplacementFlipped(Fault):
    """The sign turns while the displacement is far from zero, whenever the fault was asked for."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._flipped = False

    def reading(self, reading: Reading) -> Reading:
        self._flipped = self._flipped or abs(reading.displacement) > _FAR
        return reading._replace(displacement=-reading.displacement) if self._flipped else reading


class DisplacementDrifting(Fault):
    """The sensor's zero moves."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._drift = 0.0

    def reading(self, reading: Reading) -> Reading:
        self._drift += _DRIFT / self.occasion.sample_rate
        return reading._replace(displacement=reading.displacement + self._drift)


class RippleMissing(Fault):
    """The measurement gives nothing."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(current_rate=math.nan, flux_rate=math.nan)


class RippleNoisy(Fault):
    """The two slopes scatter, each by itself."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._random = RandomNumbers(occasion.seed)

    def reading(self, reading: Reading) -> Reading:
        current, flux = 1.0 + _RIPPLE_NOISE * math.sqrt(0.5) * self._random.normal(1, 2)[0]
        return reading._replace(
            current_rate=float(current) * reading.current_rate, flux_rate=float(flux) * reading.flux_rate
        )


class RippleScale(Fault):
    """The slope of the current is read too large."""

    def reading(self, reading: Reading) -> Reading:
        return reading._replace(current_rate=_RIPPLE_SCALE * reading.current_rate)
