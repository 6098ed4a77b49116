"""What a fault can change: a reading, the counters, the frames, the status, the driven current, the plant."""

from typing import TYPE_CHECKING, NamedTuple

from mount_driver.can_library import can
from mount_driver.protocol import Status
from mount_models.sampling import SAMPLE_RATE
from mount_sim.electronics.electronics import Reading

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant


class Occasion(NamedTuple):
    """When a fault is there, in s of simulated time, and what its random numbers begin with; Hz."""

    begin: float
    end: float
    seed: tuple[int, ...] = (0,)
    sample_rate: float = SAMPLE_RATE


class Fault:
    """One occurrence of a fault; a kind of fault overrides what it changes.

    All but `plant` is asked for once in each sample in which the fault is present, in the order in which it
    stands here.
    """

    deaf = False
    """Whether setpoints are lost."""
    restarts = False
    """Whether the electronics begin anew with this sample, their counters of frames and setpoint too."""

    def __init__(self, occasion: Occasion):
        self.occasion = occasion

    def reading(self, reading: Reading) -> Reading:
        """Return what the sensors give instead of `reading`."""
        return reading

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        """Return sample counter and clock of the electronics instead of these; they may pass their widths."""
        return sample, microseconds

    def on_bus(self, frames: list[can.Message]) -> list[can.Message]:
        """Return the frames that the bus carries in this sample instead of `frames`."""
        return frames

    def status(self, status: Status) -> Status:
        """Return what the electronics say of themselves instead of `status`."""
        return status

    def driven(self, wanted: float) -> float:
        """Return the current (A) that the power stage drives where `wanted` (A) is asked of it."""
        return wanted

    def plant(self, plant: 'Plant') -> 'Plant':
        """Return the plant as it is while the fault is there."""
        return plant
