"""Whether this machine kept the time of the 1 kHz loop, as driver and simulator tell it."""

from collections.abc import Mapping
from typing import NamedTuple

from mount_sim.diagnosis import LATE_SHARE


class Pace(NamedTuple):
    """What went wrong with the time so far, and of how many samples."""

    timeouts: int
    samples: int
    overruns: int

    def was_late_since(self, earlier: 'Pace') -> bool:
        """Whether setpoints stopped, or more samples were late than the simulator puts up with."""
        overruns, samples = self.overruns - earlier.overruns, self.samples - earlier.samples
        return self.timeouts > earlier.timeouts or overruns > LATE_SHARE * samples


def pace(driver: Mapping[str, str], sim: Mapping[str, str]) -> Pace:
    """Return the pace that the figures of driver and simulator tell; without them nothing was late."""
    return Pace(
        timeouts=int(driver.get('late_setpoints', 0)),
        samples=int(sim.get('samples', 0)),
        overruns=int(sim.get('overruns', 0)),
    )
