"""How hot the coil is by a model of its own, and the current that it may carry.

No bus and no clock here. The model runs on the greater of the measured and the sent current, so a sensor of
current that reads too little does not cool it; a temperature that the electronics report may only raise it.
"""

from mount_models.coil.heating import CoilHeating, highest_current, warmed
from mount_models.sampling import HIGHEST_CURRENT

_STEP = 100_000_000  # ns, chosen: the model goes on 10 times a second, the square of the current each sample
_LONGEST_STEP = 2_000_000_000  # ns, chosen: of a longer pause nothing is known, so the coil has not cooled


class HeatWatch:
    """The temperature of the coil; it outlives an activation of the driver, as the heat does."""

    def __init__(self, heating: CoilHeating):
        self.celsius = heating.ambient_celsius
        """Temperature of the coil by the model, degC."""
        self.current_limit = HIGHEST_CURRENT
        """What the coil may carry, A."""
        self.derating = heating.derating_celsius
        self.limit = heating.limit_celsius
        self._heating = heating
        self._begin: int | None = None  # stamp of the sample from which the squares are summed
        self._squares, self._samples = 0.0, 0

    def begin(self) -> None:
        """Start with stamps of another clock: what lies between is not known and cools nothing."""
        self._begin = None

    def take(self, stamp: int, measured: float, sent: float) -> None:
        """Take the current that was measured at `stamp` (ns) and the one that was sent last, both A."""
        if self._begin is None:
            self._begin, self._squares, self._samples = stamp, 0.0, 0
        current = measured if measured > sent else sent  # `sent` where `measured` is not valid (NaN)
        self._squares += current * current
        self._samples += 1
        if stamp - self._begin >= _STEP:
            self._go_on(stamp)

    def take_reported(self, celsius: float) -> None:
        """Take the temperature that the electronics report, degC; NaN where they know none."""
        if celsius > self.celsius:
            self._set(celsius)

    def _go_on(self, stamp: int) -> None:
        assert self._begin is not None
        elapsed = stamp - self._begin
        if elapsed <= _LONGEST_STEP:
            mean_square = self._squares / self._samples
            self._set(warmed(self._heating, self.celsius, mean_square, 1e-9 * elapsed))
        self._begin, self._squares, self._samples = stamp, 0.0, 0

    def _set(self, celsius: float) -> None:
        self.celsius = celsius
        self.current_limit = highest_current(self._heating, celsius, HIGHEST_CURRENT)
