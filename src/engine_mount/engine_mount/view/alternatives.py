"""Other mounts and other policies, simulated on the acceleration of the chassis that comes in.

The acceleration is that of a chassis which carries the mount that is driven: what another mount would have
done to the chassis itself is not in it. The engine is about an eighth of the car, so that this is little.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.settings.chosen import Parameters, chosen_control
from mount_control.controller import ControlLaw, Controller
from mount_control.policy.registry import POLICIES
from mount_models.quantity import with_flattened
from mount_models.sampling import sample_time_ns
from mount_ros.messages.force_table import ForceTable
from mount_sim.excitation.excitation import Seat
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seated_mount
from mount_sim.plant.plant import PlantSimulation

_LONGEST_PAUSE = 1_000_000_000  # ns, chosen: behind a longer one all begin anew, at rest
_QUIET = np.zeros(5)  # no noise of the sensors
_AVERAGED = 5_000_000_000  # ns, chosen: gravity and offset of an accelerometer are averaged over 5 s
_MOUNTS = {'hydro': ('hydromount', 'hydro'), 'undamped': ('undamped', 'elastomer')}
"""{key: (label, mount)} of what stands beside every drive."""


class _Mount(NamedTuple):
    """A mount under an accelerated chassis, with or without a controller."""

    plant: PlantSimulation
    controller: Controller | None


class Alternatives:
    """All alternatives over one stream of accelerations; begins anew after a pause."""

    def __init__(self, parameters: Parameters, table: ForceTable | None, offset_current: float = 0.0):
        """Take the parameters of the drive; policies need the table of its initialisation, current in A."""
        self._plant = with_flattened(SimParameters(), parameters.get('mount_sim', {})).plant
        self._parameters = parameters
        self._table, self._offset_current = table, offset_current
        control = chosen_control(parameters).parameters
        self._period = sample_time_ns(control.sample_rate)  # ns
        self._steps = round(self._period * 1e-9 / STEP_TIME)
        self.labels = {key: label for key, (label, _) in _MOUNTS.items()}
        """{key: label} of each alternative: the other mounts, and the other policies."""
        if table is not None:
            self.labels |= {name: name for name in POLICIES if name != control.policy}
        self._begin()

    def advance(
        self, stamps: Sequence[int], accelerations: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64]]:
        """Return {key: displacements (n,) in m} at n samples of acceleration, m/s^2 upwards, stamps in ns."""
        found = {key: np.empty(len(stamps)) for key in self.labels}
        for place, (stamp, acceleration) in enumerate(zip(stamps, accelerations.tolist(), strict=True)):
            values = self._excitation(stamp, acceleration)
            for key, (plant, controller) in self._mounts.items():
                current = controller.step(self._moved[key]) if controller is not None else 0.0
                plant.advance(values, np.zeros(len(values)), current)
                self._moved[key] = found[key][place] = plant.read(_QUIET)[0]
        return found

    def _begin(self) -> None:
        self._mounts = {key: self._simulated(key) for key in self.labels}
        self._moved = dict.fromkeys(self.labels, 0.0)
        self._last: tuple[int, float] | None = None
        self._mean = 0.0

    def _simulated(self, key: str) -> _Mount:
        _, mount = _MOUNTS.get(key, ('', 'friction'))
        plant = self._plant._replace(mount=seated_mount(mount))
        controller = None
        if key not in _MOUNTS and self._table is not None:
            control = {**self._parameters.get('mount_control', {}), 'policy': key}
            settings = chosen_control({**self._parameters, 'mount_control': control})
            table = settings.table(self._table.current, self._table.normal_force, self._offset_current)
            controller = Controller(ControlLaw(settings, table))
        return _Mount(PlantSimulation(plant, Seat.ACCELERATED_CHASSIS, STEP_TIME), controller)

    def _excitation(self, stamp: int, acceleration: float) -> NDArray[np.float64]:
        """Return the excitation from the last sample to this one, at the plant's steps."""
        if self._last is None or not 0 < stamp - self._last[0] <= _LONGEST_PAUSE:
            if self._last is not None:
                self._begin()
            self._last, self._mean = (stamp, 0.0), acceleration
            return np.zeros(self._steps)
        before, last = self._last
        self._mean += self._period / _AVERAGED * (acceleration - self._mean)
        now = acceleration - self._mean
        steps = self._steps * max(1, round((stamp - before) / self._period))
        self._last = stamp, now
        return last + (now - last) * np.arange(1, steps + 1) / steps
