"""The (simulated) rig at fixed gaps: force and coil ripple over the current, as arrays.

As the authors did: the gap is held, the current stepped, force and coil ripple are measured. The same as
recordings makes `engine-mount calibrate rack`; law and gap curves are fitted by `engine-mount calibrate`.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_mount.reports.drive.signals import FloatArray
from mount_models.coil.gap import measured_inductance
from mount_models.sampling import HIGHEST_CURRENT
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.reluctance import force as magnetic_force
from mount_sim.plant.ripple import RippleCoil, current_rate, flux_rate

RIG_GAPS = np.linspace(250e-6, 550e-6, 31)
"""Gaps held on the rig, m (chosen): contact gaps of new and worn pads up to the gap at rest."""

RIG_CURRENTS = np.linspace(0.0, HIGHEST_CURRENT, 151)
"""Currents stepped through at each gap, A (chosen)."""


@dataclass(frozen=True)
class RigMeasurements:
    """Gaps (m, shape (G,)), currents (A, (I,)), force (N, (G, I)) and incremental inductance (H, (G, I))."""

    gaps: FloatArray
    currents: FloatArray
    force: FloatArray
    inductance: FloatArray


def measure_actuator(
    actuator: ReluctanceActuator,
    coil: RippleCoil,
    gaps: npt.ArrayLike = RIG_GAPS,
    currents: npt.ArrayLike = RIG_CURRENTS,
    *,
    force_noise: float = 0.0,
    ratio_noise: float = 0.0,
    seed: int = 0,
) -> RigMeasurements:
    """Return force and ripple inductance at every pair of `gaps` (m) and `currents` (A), the gap held.

    The noises are standard deviations: of the force (N), of the ratio of flux rate to current rate (1).
    """
    gaps, currents = np.asarray(gaps, float), np.asarray(currents, float)
    turns_area = actuator.turns * actuator.gap_area
    force, inductance = np.empty((2, gaps.size, currents.size))
    for place in np.ndindex(force.shape):
        gap, current = gaps[place[0]], currents[place[1]]
        force[place] = magnetic_force(actuator, current, gap)
        inductance[place] = measured_inductance(
            turns_area, flux_rate(coil, actuator, current), current_rate(coil, actuator, current, gap)
        )
    random = np.random.default_rng(seed)
    force += force_noise * random.standard_normal(force.shape)
    inductance *= 1.0 + ratio_noise * random.standard_normal(force.shape)
    return RigMeasurements(gaps, currents, force, inductance)
