"""Faults of the electronics' clock and counters."""

from mount_driver.can_library import can
from mount_sim.electronics.faults.contract import Fault, Occasion

_JUMP = 10_000_000  # us, chosen: farther than any pause of the frames
_DRIFT = 1000e-6  # 1; the driver follows a quartz of at most 500 ppm
_WIDTH_SAMPLE, _WIDTH_MICROSECOND = 1 << 16, 1 << 32
_US = 1e6  # us per s


def _samples(time: float, sample_rate: float) -> int:
    return round(time * sample_rate)


class ClockJump(Fault):
    """The microsecond counter is 10 s ahead; the samples are counted on."""

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        return sample, microseconds + _JUMP


class ClockDrift(Fault):
    """The microsecond counter runs 1000 ppm too fast."""

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        since = microseconds - round(self.occasion.begin * _US)
        return sample, microseconds + round(_DRIFT * since)


class CounterWrap(Fault):
    """Both counters start so that they go through their highest value to 0 at the told time."""

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        wrap = _samples(self.occasion.begin, self.occasion.sample_rate)
        return (
            sample + _WIDTH_SAMPLE - wrap % _WIDTH_SAMPLE,
            microseconds + _WIDTH_MICROSECOND - round(wrap / self.occasion.sample_rate * _US),
        )


class ElectronicsReset(Fault):
    """No power for a while: no frames, no current; then all counters and the clock start from 0.

    It stays for good: what follows counts from its end.
    """

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._back = _samples(occasion.end, occasion.sample_rate)
        self.deaf = True

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        self.restarts = sample == self._back
        self.deaf = sample < self._back
        passed = sample - self._back
        return (
            (sample, microseconds) if self.deaf else (passed, round(passed / self.occasion.sample_rate * _US))
        )

    def on_bus(self, frames: list[can.Message]) -> list[can.Message]:
        return [] if self.deaf else frames

    def driven(self, wanted: float) -> float:
        return 0.0 if self.deaf else wanted
