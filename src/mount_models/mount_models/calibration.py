"""Calibrate an actuator on the (simulated) rig: measure it at fixed gaps, fit what the controller needs.

As the authors did: the gap is held, the current stepped, force and coil ripple are measured; Eqs (3), (4)
and the curves of Fig 4 are fitted, all from arrays, for experiments and tests. From recordings do the same
`engine-mount calibrate` and `engine-mount identify`; with them `make identify` writes the default specimen.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mount_models.actuator.fit import ForceLawFit, fit_force_law
from mount_models.actuator.reluctance import ReluctanceActuator
from mount_models.actuator.reluctance import force as magnetic_force
from mount_models.closing import ClosingMechanics
from mount_models.coil.crossing import find_crossing
from mount_models.coil.gap import measured_inductance
from mount_models.coil.gap_fit import GapCurvesFit, fit_gap_curves
from mount_models.coil.ripple import RippleCoil, current_rate, flux_rate
from mount_models.specimen import Specimen, checked_specimen

FloatArray = npt.NDArray[np.float64]

RIG_GAPS = np.linspace(250e-6, 550e-6, 31)
"""Gaps held on the rig, m (chosen): contact gaps of new and worn pads up to the gap at rest."""

RIG_CURRENTS = np.linspace(0.0, 3.0, 151)
"""Currents stepped through at each gap, A (chosen)."""

LAW_GAPS = (270e-6, 550e-6)
"""Gaps that the force law is fitted to, m (chosen): it meets 280 .. 540 um with some room on either side."""

LAW_LOWEST_CURRENT = 0.1
"""Current from which the force law is fitted, A (chosen); below, force sensors see next to nothing."""


class CalibrationError(ValueError):
    """The rig cannot measure what is asked; the text says what and the remedy."""


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


def calibrate(
    measurements: RigMeasurements,
    name: str,
    mechanics: ClosingMechanics | None = None,
    rest_current: float = 0.2,
    crossing_inductance: float = 20e-3,
    law_gaps: tuple[float, float] = LAW_GAPS,
    provenance: dict[str, Any] | None = None,
) -> Specimen:
    """Return the specimen that the rig's measurements give; stiffnesses are known by design.

    Temperature is not compensated.
    Raises `CalibrationError`, `ForceLawRefusedError`, `GapCurvesRefusedError` or `CrossingError`.
    """
    design = ClosingMechanics() if mechanics is None else mechanics
    curves_fit = _gap_curves(measurements, rest_current, crossing_inductance)
    law_fit = _force_law(measurements, law_gaps)
    return checked_specimen(
        Specimen(
            name=name,
            force_law=law_fit.law,
            gap_curves=curves_fit.curves,
            turns_area=float(measurements.turns_area),
            spring_stiffness=design.spring_stiffness,
            pad_stiffness=design.pad_stiffness,
            rest_current=rest_current,
            crossing_inductance=crossing_inductance,
            current_limit=law_fit.law.current_high,
            provenance={**(provenance or {}), **_fit_quality(law_fit, curves_fit)},
        )
    )


def _force_law(measurements: RigMeasurements, law_gaps: tuple[float, float]) -> ForceLawFit:
    rounding = 1e-12  # m
    rows = (measurements.gaps >= law_gaps[0] - rounding) & (measurements.gaps <= law_gaps[1] + rounding)
    columns = measurements.currents >= LAW_LOWEST_CURRENT - 1e-9
    return fit_force_law(
        measurements.gaps[rows][:, np.newaxis],
        measurements.currents[columns],
        measurements.force[np.ix_(rows, columns)],
    )


def _gap_curves(
    measurements: RigMeasurements, rest_current: float, crossing_inductance: float
) -> GapCurvesFit:
    currents = measurements.currents
    if not currents[0] <= rest_current <= currents[-1]:
        raise CalibrationError(
            f'rest current ({rest_current:.3f} A) must lie within the measured {currents[0]:.3f} .. '
            f'{currents[-1]:.3f} A; measure there too'
        )
    at_rest = [np.interp(rest_current, currents, row) for row in measurements.inductance]
    crossings = [find_crossing(currents, row, crossing_inductance).current for row in measurements.inductance]
    return fit_gap_curves(measurements.gaps, at_rest, crossings)


def _fit_quality(law_fit: ForceLawFit, curves_fit: GapCurvesFit) -> dict[str, Any]:
    quality = {
        'force_relative_rms': law_fit.relative_rms,
        'force_relative_worst': law_fit.worst,
        'force_rms_error': law_fit.rms_error,
        'force_largest_error': law_fit.largest_error,
    }
    for name, error in curves_fit.largest_gap_error.items():
        quality[f'{name}_largest_error'] = error
    # four digits say all there is to say; further ones might differ between machines
    return {'fit': {name: float(f'{value:.4g}') for name, value in quality.items()}}
