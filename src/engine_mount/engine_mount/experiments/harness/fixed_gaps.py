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
class RigNoise:
    """Standard deviations of the rig's sensors: force (N) and the ratio of flux rate to current rate (1)."""

    force: float = 0.0
    inductance_ratio: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class RigMeasurements:
    """Gaps (m, shape (G,)), currents (A, (I,)), force (N, (G, I)) and incremental inductance (H, (G, I))."""

    gaps: FloatArray
    currents: FloatArray
    force: FloatArray
    inductance: FloatArray
    turns_area: float


def measure_actuator(
    actuator: ReluctanceActuator,
    coil: RippleCoil,
    gaps: npt.ArrayLike = RIG_GAPS,
    currents: npt.ArrayLike = RIG_CURRENTS,
    noise: RigNoise | None = None,
) -> RigMeasurements:
    """Return force and ripple inductance at every pair of `gaps` (m) and `currents` (A), the gap held."""
    gaps, currents = np.asarray(gaps, float), np.asarray(currents, float)
    turns_area = actuator.turns * actuator.gap_area
    shape = (gaps.size, currents.size)
    force, inductance = np.empty(shape), np.empty(shape)
    for row, gap in enumerate(gaps):
        for column, current in enumerate(currents):
            force[row, column] = magnetic_force(actuator, current, gap)
            inductance[row, column] = measured_inductance(
                turns_area, flux_rate(coil, actuator, current), current_rate(coil, actuator, current, gap)
            )
    if noise is not None:
        random = np.random.default_rng(noise.seed)
        force = force + noise.force * random.standard_normal(shape)
        inductance = inductance * (1.0 + noise.inductance_ratio * random.standard_normal(shape))
    return RigMeasurements(gaps, currents, force, inductance, turns_area)
