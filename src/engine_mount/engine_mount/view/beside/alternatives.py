"""Other mounts and other policies, simulated on the acceleration of the chassis that comes in.

The acceleration is that of a chassis which carries the mount that is driven: what another mount would have
done to the chassis itself is not in it. The engine is about an eighth of the car, so that this is little.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
from mount_sim.plant.plant import Plant, PlantSimulation

_LONGEST_PAUSE = 1_000_000_000  # ns, chosen: behind a longer one all begin anew, at rest
_QUIET = np.zeros(5)  # no noise of the sensors
_AVERAGED = 5_000_000_000  # ns, chosen: gravity and offset of an accelerometer are averaged over 5 s

Displacements = NDArray[np.float64]


@dataclass(frozen=True)
class Alternative:
    """What stands beside: `key` of its line, `label`, the mount, and the policy of a friction mount."""

    key: str
    label: str
    mount: str
    policy: str = ''


MOUNTS_BESIDE = (
    Alternative('hydro', 'hydromount', 'hydro'),
    Alternative('undamped', 'undamped', 'elastomer'),
)


def alternatives_to(policy: str) -> tuple[Alternative, ...]:
    """Return all that stands beside a drive with `policy`: the other mounts, and the other policies."""
    others = tuple(Alternative(name, name, 'friction', name) for name in POLICIES if name != policy)
    return (*MOUNTS_BESIDE, *others)


class Beside:
    """All alternatives over one stream of accelerations; begins anew after a pause."""

    def __init__(self, parameters: Parameters, table: ForceTable | None, offset_current: float = 0.0):
        """Take the parameters of the drive; policies need the table of its initialisation, current in A."""
        self._plant = with_flattened(SimParameters(), parameters.get('mount_sim', {})).plant
        self._parameters = parameters
        self._table, self._offset_current = table, offset_current
        control = chosen_control(parameters).parameters
        self._period = sample_time_ns(control.sample_rate)  # ns
        self._steps = round(self._period * 1e-9 / STEP_TIME)
        self.alternatives = tuple(
            found for found in alternatives_to(control.policy) if not found.policy or table is not None
        )
        self._begin()

    def _begin(self) -> None:
        self._mounts = [self._simulated(found) for found in self.alternatives]
        self._last: tuple[int, float] | None = None
        self._mean = 0.0

    def advance(self, stamps: Sequence[int], accelerations: NDArray[np.float64]) -> dict[str, Displacements]:
        """Return {key: displacements (n,) in m} at n samples of acceleration, m/s^2 upwards, stamps in ns."""
        found: dict[str, list[float]] = {one.key: [] for one in self.alternatives}
        for stamp, acceleration in zip(stamps, accelerations.tolist(), strict=True):
            values = self._values(stamp, acceleration)
            for one, mount in zip(self.alternatives, self._mounts, strict=True):
                found[one.key].append(mount.advance(values))
        return {key: np.array(values) for key, values in found.items()}

    def _values(self, stamp: int, acceleration: float) -> NDArray[np.float64]:
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

    def _simulated(self, one: Alternative) -> '_Simulated':
        plant = self._plant._replace(mount=seated_mount(one.mount))
        controller = None
        if one.policy and self._table is not None:
            control = {**self._parameters.get('mount_control', {}), 'policy': one.policy}
            settings = chosen_control({**self._parameters, 'mount_control': control})
            table = settings.table(self._table.current, self._table.normal_force, self._offset_current)
            controller = Controller(ControlLaw(settings, table))
        return _Simulated(plant, controller)


class _Simulated:
    """A mount under an accelerated chassis, with or without a controller."""

    def __init__(self, plant: Plant, controller: Controller | None):
        self._plant = PlantSimulation(plant, Seat.ACCELERATED_CHASSIS, STEP_TIME)
        self._controller = controller
        self._displacement = 0.0

    def advance(self, values: NDArray[np.float64]) -> float:
        """Return the displacement (m) behind the steps of `values`, the acceleration in m/s^2."""
        current = self._controller.step(self._displacement) if self._controller is not None else 0.0
        self._plant.advance(values, np.zeros(len(values)), current)
        self._displacement = self._plant.read(_QUIET)[0]
        return self._displacement
