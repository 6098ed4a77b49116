"""Other mounts, simulated on the acceleration of the chassis that comes in.

The acceleration is that of a chassis which carries the mount that is driven: what another mount would have
done to the chassis itself is not in it. Over the gap of the motorway the hydromount moves 2.10 mm here, and
1.74 mm in its own drive.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engine_mount.reports.drive.beside import simulations_beside
from engine_mount.settings.chosen import Parameters, control_parameters
from mount_models.quantity import with_flattened
from mount_models.sampling import sample_time_ns
from mount_sim.excitation.excitation import Seat
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters

_LONGEST_PAUSE = 1_000_000_000  # ns, chosen: behind a longer one all begin anew, at rest
_QUIET = np.zeros(5)  # no noise of the sensors


class Alternatives:
    """All mounts that stand beside a drive over one stream of accelerations; begins anew after a pause."""

    def __init__(self, parameters: Parameters):
        """Take the parameters of the drive; raises a `ValueError` for those of another version."""
        self._plant = with_flattened(SimParameters(), parameters.get('mount_sim', {})).plant
        self._period = sample_time_ns(control_parameters(parameters).sample_rate)  # ns
        self._steps = round(self._period * 1e-9 / STEP_TIME)
        self._begin()

    def advance(
        self, stamps: Sequence[int], accelerations: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64]]:
        """Return {name: displacements (n,) in m} at n accelerations (m/s^2 upwards) with stamps in ns."""
        found = {name: np.empty(len(stamps)) for name in self._mounts}
        for place, (stamp, acceleration) in enumerate(zip(stamps, accelerations.tolist(), strict=True)):
            values = self._excitation(stamp, acceleration)
            for name, plant in self._mounts.items():
                plant.advance(values, np.zeros(len(values)), 0.0)
                found[name][place] = plant.read(_QUIET)[0]
        return found

    def _begin(self) -> None:
        self._mounts = simulations_beside(self._plant, Seat.ACCELERATED_CHASSIS, STEP_TIME)
        self._last: tuple[int, float] | None = None

    def _excitation(self, stamp: int, acceleration: float) -> NDArray[np.float64]:
        """Return the excitation from the last sample to this one, at the plant's steps."""
        if self._last is None or not 0 < stamp - self._last[0] <= _LONGEST_PAUSE:
            if self._last is not None:
                self._begin()
            self._last = stamp, acceleration
        before, last = self._last
        steps = self._steps * max(1, round((stamp - before) / self._period))
        self._last = stamp, acceleration
        return last + (acceleration - last) * np.arange(1, steps + 1) / steps
