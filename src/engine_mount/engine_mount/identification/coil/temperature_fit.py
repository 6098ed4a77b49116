"""The temperature compensation of the gap curves: measured at two temperatures, or stated from one.

Stated means: the depth of the skin from an assumed conductivity and from the duty that the copper's
resistance then asks of the bridge, and what of the reluctance is not in the core from how the force law falls
with the gap (F = i^2/2 |dL/d gap|, without saturation). Leakage then counts as if it were gap, so a measured
compensation is the better one.
"""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from engine_mount.identification.coil.gap_point import GapPoint
from mount_models.actuator.law import ForceLaw, checked_force
from mount_models.coil.gap import GapCurves, ScaledPolynomial, evaluate
from mount_models.coil.resistance import COPPER_COEFFICIENT
from mount_models.coil.temperature import (
    CONDUCTIVITY_COEFFICIENT,
    TemperatureCompensation,
    check_compensation,
)
from mount_models.quantity import LawRefusedError
from mount_sim.plant.ripple import RippleCoil, duty, skin_factor

FloatArray = npt.NDArray[np.float64]

LOWEST_CELSIUS, HIGHEST_CELSIUS = -40.0, 120.0
"""Range of coil temperatures that is compensated, degC (chosen)."""


def measured_compensation(
    curves: GapCurves,
    calibration_celsius: float,
    points: Sequence[GapPoint],
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
) -> TemperatureCompensation:
    """Return the shifts that `points` at one other temperature show against the curves.

    Raises `LawRefusedError` for too few gaps, `LawRefusedError` for temperatures too much alike.
    """
    inside = [p for p in points if curves.inductance_of_gap.low <= p.gap <= curves.inductance_of_gap.high]
    if len(inside) < _FEWEST_GAPS:
        raise LawRefusedError(
            f'a temperature compensation needs recordings at {_FEWEST_GAPS} or more gaps within '
            f'{curves.inductance_of_gap.low * 1e6:.0f} .. {curves.inductance_of_gap.high * 1e6:.0f} um at '
            f'the other temperature; {len(inside)} given: record more, or leave that temperature out'
        )
    gaps = np.array([point.gap for point in inside])
    at_rest = np.array([1.0 / point.inductance for point in inside])
    crossing = np.array([point.crossing_current for point in inside])
    return _compensation(
        curves,
        calibration_celsius,
        float(np.mean([point.celsius for point in inside])),
        coefficient,
        gaps,
        at_rest - 1.0 / evaluate(curves.inductance_of_gap, gaps),
        crossing - evaluate(curves.crossing_current_of_gap, gaps),
    )


def stated_compensation(
    curves: GapCurves,
    calibration_celsius: float,
    points: Sequence[GapPoint],
    law: ForceLaw,
    rest_current: float,
    crossing_inductance: float,
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
    bridge: RippleCoil | None = None,
) -> TemperatureCompensation:
    """Return the shifts 60 K further up that the conductivity's `coefficient` (1/K) lets expect.

    Of `bridge`, known by design, voltage, resistance, period and moment of sampling count.
    """
    reference = calibration_celsius + _STATED_DIFFERENCE
    bridge = RippleCoil() if bridge is None else bridge
    rest_change = _core_change(bridge, rest_current, coefficient)
    change = np.array([_core_change(bridge, point.crossing_current, coefficient) for point in points])
    gaps = np.array([point.gap for point in points])
    outside_core = gap_reluctance(law, gaps)
    at_rest = 1.0 / evaluate(curves.inductance_of_gap, gaps) - outside_core
    at_crossing = 1.0 / crossing_inductance - outside_core
    if not (np.all(at_rest > 0.0) and np.all(at_crossing > 0.0)):
        raise LawRefusedError(
            'the force law and the inductances contradict each other: by the force the gap alone has more '
            'reluctance than was measured; are they of the same actuator, and is turns_area right?'
        )
    per_current = np.array([-point.crossing_slope for point in points]) / crossing_inductance**2
    return _compensation(
        curves,
        calibration_celsius,
        reference,
        coefficient,
        gaps,
        at_rest * (rest_change - 1.0),
        at_crossing * (1.0 / change - 1.0) / per_current,
    )


def gap_reluctance(law: ForceLaw, gap: FloatArray) -> FloatArray:
    """Return what the gaps (m) contribute to 1/L (1/H), as the force law tells below saturation."""
    gaps = np.linspace(law.gap_low, law.gap_high, 21)
    current = _UNSATURATED * law.current_high
    root = current / np.sqrt(2.0 * checked_force(law, current, gaps))
    slope, offset = np.polyfit(gaps, root, 1)
    return np.asarray(slope * (slope * np.asarray(gap, float) + offset))


_FEWEST_GAPS = 4
_STATED_DIFFERENCE = 60.0  # K, chosen
_THICK = 100.0  # periods of diffusion: thick plates, whose skin goes with the root of the conductivity
_UNSATURATED = 0.25  # chosen: share of the largest current at which force still goes with its square


def _core_change(bridge: RippleCoil, current: float, coefficient: float) -> float:
    """Return the factor on the core's reluctance after `_STATED_DIFFERENCE`, at a current (A)."""
    resistance = bridge.resistance * (1.0 + COPPER_COEFFICIENT * _STATED_DIFFERENCE)
    thick = _THICK * bridge.pwm_period
    cold = skin_factor(bridge, thick, duty(bridge, current))
    warm = skin_factor(bridge, thick, duty(bridge._replace(resistance=resistance), current))
    return float(warm / cold) / math.sqrt(1.0 + coefficient * _STATED_DIFFERENCE)


def _compensation(
    curves: GapCurves,
    calibration_celsius: float,
    reference_celsius: float,
    coefficient: float,
    gaps: FloatArray,
    reluctance_shift: FloatArray,
    crossing_shift: FloatArray,
) -> TemperatureCompensation:
    compensation = TemperatureCompensation(
        calibration_celsius=calibration_celsius,
        reference_celsius=reference_celsius,
        lowest_celsius=min(LOWEST_CELSIUS, calibration_celsius, reference_celsius),
        highest_celsius=max(HIGHEST_CELSIUS, calibration_celsius, reference_celsius),
        conductivity_coefficient=coefficient,
        reluctance_shift=_parabola(curves, gaps, reluctance_shift),
        crossing_shift=_parabola(curves, gaps, crossing_shift),
    )
    check_compensation(compensation, curves)
    return compensation


def _parabola(curves: GapCurves, gaps: FloatArray, values: FloatArray) -> ScaledPolynomial:
    low, high = curves.inductance_of_gap.low, curves.inductance_of_gap.high
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    coefficients = np.polynomial.polynomial.polyfit((gaps - centre) / scale, values, 2)
    return ScaledPolynomial(centre, scale, tuple(float(value) for value in coefficients), low, high)
