"""What the coil's temperature does to the gap curves, and how a measurement is carried back to them.

A warmer core conducts less, so the ripple reaches more of it: the inductance rises, and a gap read from
it would be too small. The calibration tells by how much at one other temperature; in between the shift goes
with the square root of the conductivity, as the depth of the skin does (derived).
"""

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np

from mount_models.coil.gap import GapCurves, ScaledPolynomial, evaluate
from mount_models.quantity import LawRefusedError, OutsideLawError, Quantity

CONDUCTIVITY_COEFFICIENT = 0.0043
"""Relative rise of the core's resistivity per kelvin, 1/K (chosen: 8 % less conductivity after 20 K)."""


class TemperatureCompensation(NamedTuple):
    """Shifts of both gap curves from `calibration_celsius` to `reference_celsius`, over the gap (m).

    `reluctance_shift` is that of 1 / L_0.2 (1/H), `crossing_shift` that of i_20 (A). Used within
    `lowest_celsius` .. `highest_celsius`.
    """

    calibration_celsius: Annotated[
        float, Quantity('degC', 'coil temperature at which the gap curves hold', -60.0, 250.0)
    ]
    reference_celsius: Annotated[
        float, Quantity('degC', 'coil temperature at which the shifts hold', -60.0, 250.0)
    ]
    lowest_celsius: Annotated[float, Quantity('degC', 'lowest coil temperature compensated', -60.0, 250.0)]
    highest_celsius: Annotated[float, Quantity('degC', 'highest coil temperature compensated', -60.0, 250.0)]
    conductivity_coefficient: Annotated[
        float, Quantity('1/K', 'rise of the resistivity of the core per kelvin', 0.0, 0.02)
    ]
    reluctance_shift: ScaledPolynomial
    crossing_shift: ScaledPolynomial


def temperature_share(compensation: TemperatureCompensation, celsius: float) -> float:
    """Return which share of the shifts holds at a coil temperature: 0 at calibration, 1 at reference."""
    there = skin_change(compensation, celsius)
    return there / skin_change(compensation, compensation.reference_celsius)


def skin_change(compensation: TemperatureCompensation, celsius: float) -> float:
    """Return the relative change of the root of the conductivity from the temperature of calibration on."""
    warmer = celsius - compensation.calibration_celsius
    coefficient = max(compensation.conductivity_coefficient, 1e-6)  # in the limit a straight line
    return 1.0 / math.sqrt(1.0 + coefficient * warmer) - 1.0


def inductance_at_calibration(
    compensation: TemperatureCompensation, curves: GapCurves, inductance: float, celsius: float
) -> float:
    """Return what the inductance (H) at the rest current would be at the temperature of the curves.

    Raises `OutsideLawError` for a temperature that is not compensated.
    """
    share = _checked_share(compensation, celsius)
    if share == 0.0:
        return inductance

    curve, shift = curves.inductance_of_gap, compensation.reluctance_shift

    def reluctance(gap: float) -> float:
        return 1.0 / float(evaluate(curve, gap))

    return 1.0 / _without_shift(1.0 / inductance, reluctance, share, shift, curve)


def crossing_at_calibration(
    compensation: TemperatureCompensation, curves: GapCurves, current: float, celsius: float
) -> float:
    """Return what the crossing current (A) would be at the temperature of the curves.

    Raises `OutsideLawError` for a temperature that is not compensated.
    """
    share = _checked_share(compensation, celsius)
    if share == 0.0:
        return current

    curve, shift = curves.crossing_current_of_gap, compensation.crossing_shift

    def crossing(gap: float) -> float:
        return float(evaluate(curve, gap))

    return _without_shift(current, crossing, share, shift, curve)


def check_compensation(compensation: TemperatureCompensation, curves: GapCurves) -> None:
    """Raise `LawRefusedError` unless temperatures are in order and the curves stay monotone with them."""
    c = compensation
    if not c.lowest_celsius <= c.calibration_celsius <= c.highest_celsius:
        raise LawRefusedError(
            f'calibration_celsius ({c.calibration_celsius:g} degC) must lie within lowest_celsius .. '
            f'highest_celsius ({c.lowest_celsius:g} .. {c.highest_celsius:g} degC); correct the range'
        )
    if abs(c.reference_celsius - c.calibration_celsius) < _LEAST_DIFFERENCE:
        raise LawRefusedError(
            f'reference_celsius ({c.reference_celsius:g} degC) must differ from calibration_celsius '
            f'({c.calibration_celsius:g} degC) by {_LEAST_DIFFERENCE:g} K or more; record warmer or colder'
        )
    for name in ('reluctance_shift', 'crossing_shift'):
        shift = getattr(c, name)
        if not (shift.low < shift.high and shift.scale > 0.0):
            raise LawRefusedError(
                f'{name} must have a positive scale ({shift.scale:g}) and a range in rising order '
                f'({shift.low:g} .. {shift.high:g}); calibrate again'
            )
    if not 1.0 + c.conductivity_coefficient * (c.lowest_celsius - c.calibration_celsius) > 0.1:
        raise LawRefusedError(
            f'conductivity_coefficient ({c.conductivity_coefficient:g} 1/K) must leave the core a '
            f'resistivity at {c.lowest_celsius:g} degC; lower it, or raise lowest_celsius'
        )
    curve = curves.inductance_of_gap
    gaps = np.linspace(curve.low, curve.high, 61)
    shifts = np.array([_shift(c.reluctance_shift, gap) for gap in gaps])
    for celsius in (c.lowest_celsius, c.highest_celsius):
        warm = 1.0 / evaluate(curve, gaps) + temperature_share(c, celsius) * shifts
        if not (np.all(warm > 0.0) and np.all(np.diff(warm) > 0.0)):
            raise LawRefusedError(
                f'at {celsius:g} degC the compensated inductance must still fall with the gap; it does not: '
                f'narrow lowest_celsius .. highest_celsius, or calibrate again'
            )


_LEAST_DIFFERENCE = 10.0  # K, chosen: less tells too little
_HALVINGS = 60


def _checked_share(compensation: TemperatureCompensation, celsius: float) -> float:
    if not compensation.lowest_celsius <= celsius <= compensation.highest_celsius:
        raise OutsideLawError(
            f'coil temperature ({celsius:.1f} degC) must lie within {compensation.lowest_celsius:.1f} .. '
            f'{compensation.highest_celsius:.1f} degC, where the gap curves are compensated; let the coil '
            f'cool down or warm up, or calibrate over a wider range'
        )
    return temperature_share(compensation, celsius)


def _without_shift(
    value: float,
    calibrated: Callable[[float], float],
    share: float,
    shift: ScaledPolynomial,
    curve: ScaledPolynomial,
) -> float:
    """Return `value` less the share of the shift at the gap at which it is what is measured."""
    gap = _gap_at(lambda gap: calibrated(gap) + share * _shift(shift, gap), value, curve)
    return value - share * _shift(shift, gap)


def _shift(shift: ScaledPolynomial, gap: float) -> float:
    return float(evaluate(shift, min(max(gap, shift.low), shift.high)))


def _gap_at(rising: Callable[[float], float], value: float, curve: ScaledPolynomial) -> float:
    """Return the gap (m) of the curve at which a `rising` function reaches `value`, or the nearer end."""
    low, high = curve.low, curve.high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if rising(middle) < value:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
