"""The temperature compensation of the gap curves: measured at two temperatures, or stated from one.

Stated means: the depth of the skin from an assumed conductivity and from the duty that the copper's
resistance then requires of the bridge, and what of the reluctance is not in the core from how the force law
falls with the gap (F = i^2/2 |dL/d gap|, without saturation). Leakage then counts as if it were gap, so a
measured compensation is the better one.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyfit

from engine_mount.identification.coil.points import GapPoint
from engine_mount.identification.fitting import FloatArray
from mount_models.actuator import ForceLaw, checked_force
from mount_models.coil.copper import COPPER_COEFFICIENT
from mount_models.coil.correction import (
    CONDUCTIVITY_COEFFICIENT,
    TemperatureCompensation,
    check_compensation,
    crossing_at_calibration,
    inductance_at_calibration,
)
from mount_models.coil.gap import GapCurves, ScaledPolynomial, evaluate
from mount_models.quantity import LawRefusedError
from mount_models.specimen import Specimen
from mount_sim.plant.ripple import RippleCoil, duty, skin_factor

LOWEST_CELSIUS, HIGHEST_CELSIUS = -40.0, 120.0
"""Range of coil temperatures that is compensated, degC (chosen)."""
_FEWEST_GAPS = 4
_STATED_DIFFERENCE = 60.0  # K, chosen
_THICK = 100.0  # periods of diffusion: thick plates, whose skin goes with the root of the conductivity
_UNSATURATED = 0.25  # chosen: share of the largest current at which force still goes with its square


def measured_compensation(
    curves: GapCurves,
    celsius: float,
    points: Sequence[GapPoint],
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
) -> TemperatureCompensation:
    """Return the shifts of `points` at one other temperature against the curves at `celsius`.

    Raises `LawRefusedError` for too few gaps, or temperatures too much alike.
    """
    low, high = curves.inductance_of_gap.low, curves.inductance_of_gap.high
    inside = [point for point in points if low <= point.gap <= high]
    if len(inside) < _FEWEST_GAPS:
        raise LawRefusedError(
            f'a temperature compensation needs recordings at {_FEWEST_GAPS} or more gaps within '
            f'{low * 1e6:.0f} .. {high * 1e6:.0f} um at the other temperature; {len(inside)} given: record '
            'more, or leave that temperature out'
        )
    gaps = np.array([point.gap for point in inside])
    at_rest = np.array([1.0 / point.inductance for point in inside])
    crossing = np.array([point.crossing_current for point in inside])
    return _compensation(
        curves,
        celsius,
        float(np.mean([point.celsius for point in inside])),
        coefficient,
        gaps,
        at_rest - 1.0 / evaluate(curves.inductance_of_gap, gaps),
        crossing - evaluate(curves.crossing_current_of_gap, gaps),
    )


def stated_compensation(
    curves: GapCurves,
    celsius: float,
    points: Sequence[GapPoint],
    base: Specimen,
    coefficient: float = CONDUCTIVITY_COEFFICIENT,
) -> TemperatureCompensation:
    """Return the shifts 60 K above `celsius` to be expected of the conductivity's `coefficient` (1/K).

    The force law is that of the `base`, as are rest current and crossing inductance.
    """
    law, bridge = base.force_law, RippleCoil()
    inside = [point for point in points if law.gap_low <= point.gap <= law.gap_high]
    if len(inside) < _FEWEST_GAPS:
        raise LawRefusedError(
            f'the force law of the base holds for {law.gap_low * 1e6:.0f} .. {law.gap_high * 1e6:.0f} um, '
            f'where only {len(inside)} recordings are, {_FEWEST_GAPS} are needed; calibrate the actuator '
            'first and give it as --base'
        )

    def core_change(current: float) -> float:
        """Return the factor on the core's reluctance at a current (A)."""
        resistance = bridge.resistance * (1.0 + COPPER_COEFFICIENT * _STATED_DIFFERENCE)
        thick = _THICK * bridge.pwm_period
        cold = skin_factor(bridge, thick, duty(bridge, current))
        warm = skin_factor(bridge, thick, duty(bridge._replace(resistance=resistance), current))
        return float(warm / cold) / math.sqrt(1.0 + coefficient * _STATED_DIFFERENCE)

    gaps = np.array([point.gap for point in inside])
    outside_core = gap_reluctance(law, gaps)
    at_rest = 1.0 / evaluate(curves.inductance_of_gap, gaps) - outside_core
    at_crossing = 1.0 / base.crossing_inductance - outside_core
    if not (np.all(at_rest > 0.0) and np.all(at_crossing > 0.0)):
        raise LawRefusedError(
            'the force law and the inductances contradict each other: by the force the gap alone has more '
            'reluctance than was measured; are they of the same actuator, and is turns_area right?'
        )
    change = np.array([core_change(point.crossing_current) for point in inside])
    per_current = np.array([-point.crossing_slope for point in inside]) / base.crossing_inductance**2
    return _compensation(
        curves,
        celsius,
        celsius + _STATED_DIFFERENCE,
        coefficient,
        gaps,
        at_rest * (core_change(base.rest_current) - 1.0),
        at_crossing * (1.0 / change - 1.0) / per_current,
    )


def gap_reluctance(law: ForceLaw, gap: FloatArray) -> FloatArray:
    """Return what the gaps (m) contribute to 1/L (1/H), by the force law below saturation."""
    gaps = np.linspace(law.gap_low, law.gap_high, 21)
    current = _UNSATURATED * law.current_high
    root = current / np.sqrt(2.0 * checked_force(law, current, gaps))
    slope, offset = np.polyfit(gaps, root, 1)
    return np.asarray(slope * (slope * np.asarray(gap, float) + offset))


def gap_errors(
    curves: GapCurves, compensation: TemperatureCompensation | None, points: Sequence[GapPoint], source: str
) -> list[dict[str, Any]]:
    """Return for each temperature of the points the largest gap errors (um) against their known gaps.

    At rest and at contact, without and with compensation; `source` is 'fitted' or 'held out'.
    """
    names = ('rest_uncompensated_um', 'contact_uncompensated_um', 'rest_um', 'contact_um')
    rows = []
    for celsius in sorted({round(point.celsius) for point in points}):
        worst = np.zeros(4)
        for point in (each for each in points if round(each.celsius) == celsius):
            plain = point.inductance, point.crossing_current
            carried = plain
            if compensation is not None:
                carried = (
                    inductance_at_calibration(compensation, curves, plain[0], celsius),
                    crossing_at_calibration(compensation, curves, plain[1], celsius),
                )
            gaps = [
                float(evaluate(curve, value))
                for pair in (plain, carried)
                for curve, value in zip(
                    (curves.gap_of_inductance, curves.gap_of_crossing_current), pair, strict=True
                )
            ]
            worst = np.maximum(worst, 1e6 * np.abs(np.array(gaps) - point.gap))
        figures = {name: float(f'{value:.3g}') for name, value in zip(names, worst, strict=True)}
        rows.append({'celsius': float(celsius), 'source': source, **figures})
    return rows


def _compensation(
    curves: GapCurves,
    celsius: float,
    reference: float,
    coefficient: float,
    gaps: FloatArray,
    reluctance_shift: FloatArray,
    crossing_shift: FloatArray,
) -> TemperatureCompensation:
    low, high = curves.inductance_of_gap.low, curves.inductance_of_gap.high
    centre, scale = 0.5 * (low + high), 0.5 * (high - low)
    z = (gaps - centre) / scale
    shifts = [
        ScaledPolynomial(centre, scale, tuple(polyfit(z, values, 2).tolist()), low, high)
        for values in (reluctance_shift, crossing_shift)
    ]
    compensation = TemperatureCompensation(
        calibration_celsius=celsius,
        reference_celsius=reference,
        lowest_celsius=min(LOWEST_CELSIUS, celsius, reference),
        highest_celsius=max(HIGHEST_CELSIUS, celsius, reference),
        conductivity_coefficient=coefficient,
        reluctance_shift=shifts[0],
        crossing_shift=shifts[1],
    )
    check_compensation(compensation, curves)
    return compensation
