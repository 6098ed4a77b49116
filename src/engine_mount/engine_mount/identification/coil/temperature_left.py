"""What the coil's temperature does to the measured gap, before and after compensation, in micrometres."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from engine_mount.identification.coil.gap_point import GapPoint
from mount_models.coil.gap import GapCurves, evaluate
from mount_models.coil.temperature import (
    TemperatureCompensation,
    crossing_at_calibration,
    inductance_at_calibration,
    temperature_share,
)

SHOWN_CELSIUS = (-20.0, 20.0, 80.0)
COEFFICIENT_ERROR = 0.2
"""By how much the core's true coefficient may differ from the assumed one (chosen)."""


def predicted(
    curves: GapCurves,
    compensation: TemperatureCompensation,
    with_coefficient: Callable[[float], TemperatureCompensation],
) -> list[dict[str, Any]]:
    """Return for each temperature of interest the largest gap errors (um), should the coefficient be wrong.

    `with_coefficient(value)` is the compensation as it would be were the coefficient (1/K) `value`.
    """
    rows = []
    for celsius in SHOWN_CELSIUS:
        worst = np.zeros(4)
        for error in (-COEFFICIENT_ERROR, 0.0, COEFFICIENT_ERROR):
            true = with_coefficient(compensation.conductivity_coefficient * (1.0 + error))
            worst = np.maximum(worst, _errors_of_truth(curves, compensation, true, celsius))
        rows.append(_row(celsius, worst, source='predicted'))
    return rows


def measured(
    curves: GapCurves, compensation: TemperatureCompensation | None, points: Sequence[GapPoint], source: str
) -> list[dict[str, Any]]:
    """Return for each temperature of the points the largest gap errors (um) against their known gaps."""
    rows = []
    for celsius in sorted({round(point.celsius) for point in points}):
        worst = np.zeros(4)
        for point in points:
            if round(point.celsius) == celsius:
                errors = _errors(
                    curves, compensation, point.gap, point.inductance, point.crossing_current, celsius
                )
                worst = np.maximum(worst, errors)
        rows.append(_row(float(celsius), worst, source=source))
    return rows


def _errors_of_truth(
    curves: GapCurves, compensation: TemperatureCompensation, true: TemperatureCompensation, celsius: float
) -> np.ndarray:
    share = temperature_share(true, celsius)
    worst = np.zeros(4)
    low, high = curves.inductance_of_gap.low, curves.inductance_of_gap.high
    for gap in np.linspace(low + 0.1 * (high - low), high - 0.1 * (high - low), 9):
        reluctance = 1.0 / evaluate(curves.inductance_of_gap, gap) + share * evaluate(
            true.reluctance_shift, gap
        )
        crossing = evaluate(curves.crossing_current_of_gap, gap) + share * evaluate(true.crossing_shift, gap)
        errors = _errors(curves, compensation, float(gap), 1.0 / float(reluctance), float(crossing), celsius)
        worst = np.maximum(worst, errors)
    return worst


def _errors(
    curves: GapCurves,
    compensation: TemperatureCompensation | None,
    gap: float,
    inductance: float,
    crossing: float,
    celsius: float,
) -> np.ndarray:
    """Return the errors (um) at rest and at contact without, then with compensation."""
    plain = (inductance, crossing)
    carried = plain
    if compensation is not None:
        carried = (
            inductance_at_calibration(compensation, curves, inductance, celsius),
            crossing_at_calibration(compensation, curves, crossing, celsius),
        )
    return np.array(
        [
            1e6 * abs(float(evaluate(curve, value)) - gap)
            for pair in (plain, carried)
            for curve, value in zip(
                (curves.gap_of_inductance, curves.gap_of_crossing_current), pair, strict=True
            )
        ]
    )


def _row(celsius: float, worst: np.ndarray, source: str) -> dict[str, Any]:
    names = ('rest_uncompensated_um', 'contact_uncompensated_um', 'rest_um', 'contact_um')
    figures = {name: float(f'{value:.3g}') for name, value in zip(names, worst, strict=True)}
    return {'celsius': celsius, 'source': source, **figures}
