"""What a kind of fault is, and one occurrence of it."""

import math
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from mount_driver.can_library import can
from mount_driver.protocol import Status
from mount_models.sampling import SAMPLE_RATE
from mount_sim.electronics.electronics import Reading
from mount_sim.random_numbers import RandomNumbers

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

Frames = list[can.Message]


class Kind(NamedTuple):
    """What a name stands for, and what it changes while it is present.

    All but `plant` is called once in each sample, in the order in which it stands here: `reading` of the
    sensors; sample counter and clock (us) as `counters`, which may pass their widths; `frames` that the bus
    carries in this sample; `status` of the electronics; `current` (A) that the power stage drives.
    `duration` (s) holds where the text names none.
    """

    meaning: str
    reading: 'Callable[[Fault, Reading], Reading] | None' = None
    counters: 'Callable[[Fault, tuple[int, int]], tuple[int, int]] | None' = None
    frames: 'Callable[[Fault, Frames], Frames] | None' = None
    status: 'Callable[[Fault, Status], Status] | None' = None
    current: 'Callable[[Fault, float], float] | None' = None
    plant: 'Callable[[Fault, Plant], Plant] | None' = None
    deaf: bool = False
    """Setpoints are not received."""
    duration: float = math.inf
    from_start: bool = False
    """It is present from the first sample on and so cannot begin during a run."""
    for_good: bool = False
    """It stays after its end."""
    on_bus: bool = False
    """It shows in frames alone, so not in a core run, which has none."""


@dataclass(eq=False)
class Fault:
    """One occurrence of a fault: its times in s of simulated time, and what it remembers."""

    name: str
    kind: Kind
    begin: float
    end: float
    seed: int = 0
    sample_rate: float = SAMPLE_RATE
    injected: bool = False
    """It came during the run."""
    deaf: bool = False
    restarts: bool = False
    """The electronics begin anew with this sample, their counters of frames and setpoint too."""
    count: int = 0
    drift: float = 0.0
    kept: float = math.nan
    """The first value, which the fault repeats."""
    past: deque[Frames] = field(default_factory=deque)

    @property
    def first(self) -> float:
        """Time (s) from which it is present."""
        return 0.0 if self.kind.from_start else self.begin

    @property
    def last(self) -> float:
        """Time (s) at which it is no longer present."""
        return math.inf if self.kind.for_good else self.end

    @cached_property
    def random(self) -> RandomNumbers:
        """Random numbers of this occurrence."""
        return RandomNumbers((self.seed, zlib.crc32(self.name.encode())))

    def keep(self, value: float) -> float:
        """Return the first number of the `value`s since the fault began."""
        if math.isnan(self.kept):
            self.kept = value
        return self.kept
