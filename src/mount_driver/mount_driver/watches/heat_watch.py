"""How hot the coil is by a model of its own, and the current that it may carry.

No bus and no clock here. The model runs on the greater of the measured and the sent current, so a sensor of
current that reads too little does not cool it; a temperature that the electronics report may only raise it.

Where nobody knows what the coil has carried before, the model begins as hot as current can make it, and the
first temperature that the electronics report takes the place of that assumption, though never below the
ambient of the model. Without such a sensor the coil stays derated until the model has cooled.

So that a coil that is warm, or may be, can be initialised all the same, each activation has a little current
to spare from its begin on: the ramp warms the coil by less than 1 K.
"""

from math import nan

from mount_models.coil.copper import CoilHeating, highest_current, hottest_by_current, warmed
from mount_models.sampling import HIGHEST_CURRENT

_LONGEST_STEP = 2.0  # s, chosen: of a longer pause nothing is known, so the coil has not cooled
_AGE = 10.0  # s, chosen: a temperature from before is no older; 3 A may have flowed since
_SPARE = 12.0  # A^2 s, chosen: a ramp takes 7.2; 12 warm the shipped coil by 0.5 K
_NEAR = 5.0  # K, chosen: so near to its limit nothing is spared


class HeatWatch:
    """The temperature of the coil; it outlives an activation of the driver, as the heat does."""

    def __init__(self, heating: CoilHeating, celsius: float = nan):
        """`celsius`: the temperature by what ran before, at most 10 s old; NaN where nobody knows."""
        self.known = celsius == celsius
        """Whether the temperature rests on what was measured, and not on the worst that may be."""
        self.heating = heating
        self._spare = _SPARE  # A^2 s
        if self.known:
            begin = max(celsius, heating.ambient_celsius)
            self._set(warmed(heating, begin, HIGHEST_CURRENT * HIGHEST_CURRENT, _AGE))
        else:
            self._set(hottest_by_current(heating, HIGHEST_CURRENT))

    def begin(self) -> None:
        """Let another activation begin: it has its own current to spare."""
        self._spare = _SPARE
        self._set(self.celsius)

    def warm(self, mean_square: float, seconds: float) -> None:
        """Go on by a time in which the current had this mean square, A^2."""
        if seconds <= _LONGEST_STEP:
            self._spare -= mean_square * seconds
            self._set(warmed(self.heating, self.celsius, mean_square, seconds))

    def take_reported(self, celsius: float) -> None:
        """Take the temperature that the electronics report, degC; NaN where they know none."""
        if celsius > self.celsius:
            self._set(celsius)
        elif not self.known and celsius == celsius:
            self._set(max(celsius, self.heating.ambient_celsius))
        self.known = self.known or celsius == celsius

    def _set(self, celsius: float) -> None:
        self.celsius = celsius
        """Temperature of the coil by the model, degC."""
        spared = self._spare > 0.0 and celsius < self.heating.limit_celsius - _NEAR
        limit = HIGHEST_CURRENT if spared else highest_current(self.heating, celsius, HIGHEST_CURRENT)
        self.current_limit = limit
        """What the coil may carry, A."""
