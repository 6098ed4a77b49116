"""The grid of the sensitivity and its maps: friction mount over hydromount."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.reports.drive.signals import FloatArray
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.quantity import Quantity

EVEN_WITHIN = 0.02
"""Two mounts count as even where their ratio differs from 1 by at most so much (chosen)."""


class SensitivityParameters(NamedTuple):
    """The values between which all combinations are run, separated by commas, and the common rest."""

    road_levels: str = '0.04, 0.06, 0.08, 0.10, 0.12, 0.16, 0.20'
    decoupler_resistances: str = '2e7, 5e7, 1e8, 2e8'
    chamber_asymmetries: str = '0.25, 0'
    idle_forces: str = '0, 80, 200, 400'
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 14.0, 50.0, 'Sec. 6')] = 50.0
    damper: str = DEFAULT_DAMPER
    workers: Annotated[int, Quantity('1', 'processes; 0: one for each core', 0, 256)] = 0


class Axes(NamedTuple):
    """The values of the four things: m/s, Pa s/m^3, 1, N."""

    levels: list[float]
    resistances: list[float]
    asymmetries: list[float]
    idle_forces: list[float]


@dataclass(frozen=True)
class Maps:
    """Friction mount over hydromount, below 1 where the friction mount has less.

    `peak` (level, resistance, asymmetry, idle): largest displacement from 3 to 14 Hz. `rms` (band, level,
    resistance, asymmetry, idle): chassis acceleration; NaN where the sweep ends before. `friction_peak`
    (level, idle) in m. Of each (resistance, asymmetry) on the rack, `hydro_harmonics` are those of the
    hydromount in N, `below` the orders in which the friction mount is lower. `peak_as_there` {level: m} is
    the friction mount's without idle force, with the damper of the independent computation.
    """

    axes: Axes
    peak: FloatArray
    rms: FloatArray
    friction_peak: FloatArray
    below: dict[tuple[float, float], list[int]]
    hydro_harmonics: dict[tuple[float, float], list[float]]
    peak_as_there: dict[float, float]


def lower(ratios: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where the friction mount has less than the hydromount, and not about the same."""
    return np.asarray(ratios < 1.0 - EVEN_WITHIN)


def higher(ratios: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where the friction mount has more than the hydromount, and not about the same."""
    return np.asarray(ratios > 1.0 + EVEN_WITHIN)


def share_won(ratios: FloatArray) -> float:
    """Return the share of the known ratios in which the friction mount has less, NaN if none is known."""
    known = ratios[~np.isnan(ratios)]
    return float(np.mean(lower(known))) if known.size else float('nan')
