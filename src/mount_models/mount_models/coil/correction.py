"""What temperature and supply do to the coil's ripple, and how a reading is carried back to the gap curves.

A warmer core conducts less, so the ripple reaches more of it: the inductance rises, and a gap read from
it would be too small. The calibration tells by how much at one other temperature; in between the shift goes
with the square root of the conductivity, as the depth of the skin does (derived).

The bridge holds a mean current by its duty D = (1 + R i / U) / 2. The longer it was at plus before, the more
of the ripple's field is still in the skin of the iron when the sample is taken, so D decides how much
reluctance the ripple meets there: with the same gap and current L_i falls with R / U. The share of the skin
in 1 / L_i is known from the calibration at a second temperature, where it changes by the conductivity.
"""

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arrays import FloatArray
from mount_models.coil.copper import resistance_at
from mount_models.coil.gap import GapCurves, ScaledPolynomial, check_range_of, evaluate
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
    return 1.0 / _without_shift(
        1.0 / inductance, lambda gap: 1.0 / float(evaluate(curve, gap)), share, shift, curve
    )


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
    return _without_shift(current, lambda gap: float(evaluate(curve, gap)), share, shift, curve)


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
        check_range_of(name, getattr(c, name))
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
    """Return `value` less the share of the shift at the gap (m) at which it is what is measured.

    Where the curve does not reach it, the nearer end counts.
    """
    low, high = curve.low, curve.high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if calibrated(middle) + share * _shift(shift, middle) < value:
            low = middle
        else:
            high = middle
    return value - share * _shift(shift, 0.5 * (low + high))


def _shift(shift: ScaledPolynomial, gap: float) -> float:
    return float(evaluate(shift, min(max(gap, shift.low), shift.high)))


class Bridge(NamedTuple):
    """The bridge that drives the coil: its voltage at the calibration, and when it samples the ripple."""

    link_voltage: Annotated[
        float, Quantity('V', 'voltage U of the bridge at which the gap curves hold', 1.0, 100.0)
    ] = 14.0
    lowest_voltage: Annotated[
        float, Quantity('V', 'lowest voltage to which the curves are carried', 1.0, 100.0, 'chosen')
    ] = 8.0
    highest_voltage: Annotated[
        float, Quantity('V', 'highest voltage to which the curves are carried', 1.0, 100.0, 'chosen')
    ] = 18.0
    sample_phase: Annotated[
        float,
        Quantity(
            '1', 'time from switching to the sample, in periods of the bridge', 0.001, 0.4, '18 of 200 us'
        ),
    ] = 0.09


def duty(resistance: npt.ArrayLike, current: npt.ArrayLike, voltage: npt.ArrayLike) -> FloatArray:
    """Return the share D of positive voltage (V) that holds a current (A) in a resistance (ohm)."""
    held = np.asarray(resistance, float) * np.asarray(current, float)
    return np.asarray(0.5 * (1.0 + held / np.asarray(voltage, float)))


def skin_shape(bridge: Bridge, duty: npt.ArrayLike) -> FloatArray:
    """Return the reluctance of the skin over the duty D, up to a factor that is the same for every D.

    Derived for plates that no ripple crosses: every past switching adds 1 / sqrt(its age), so with phase q
    s(D) = sum_m [(q + m)^-1/2 - (q + 1 - D + m)^-1/2] / (1 - D).
    NaN where the bridge cannot hold a current.
    """
    off = 1.0 - np.asarray(duty, float)
    off = np.where((off > 0.0) & (off < 1.0), off, np.nan)
    total = np.zeros(off.shape)
    for m in range(_TERMS):
        total = total + (
            1.0 / math.sqrt(bridge.sample_phase + m) - 1.0 / np.sqrt(bridge.sample_phase + off + m)
        )
    # what remains of the sum is an integral from half a term before it on
    rest = bridge.sample_phase + _TERMS - 0.5
    total = total + 2.0 * (np.sqrt(rest + off) - math.sqrt(rest))
    return np.asarray(total / off)


def skin_ratio(bridge: Bridge, duty: npt.ArrayLike, calibrated: npt.ArrayLike) -> FloatArray:
    """Return the reluctance of the skin at the `calibrated` duty over that at `duty`."""
    return np.asarray(skin_shape(bridge, calibrated) / skin_shape(bridge, duty))


def at_calibrated_duty(inductance: npt.ArrayLike, gap_reluctance: float, ratio: npt.ArrayLike) -> FloatArray:
    """Return what inductances (H) would be at the duty of the calibration, by `skin_ratio`.

    1 / L_i is the reluctance of the gap (`gap_reluctance`, 1/H) and that of the skin; only this one changes.
    """
    inductance = np.asarray(inductance, float)
    share = 1.0 - inductance * gap_reluctance
    return np.asarray(inductance / (1.0 + share * (np.asarray(ratio, float) - 1.0)))


def gap_reluctance(
    bridge: Bridge,
    curves: GapCurves,
    compensation: TemperatureCompensation,
    resistance: float,
    rest_current: float,
    gap: float,
) -> float:
    """Return the share of the gap in 1 / L_i (1/H) at a gap (m) within the curves, else at their nearer end.

    At `rest_current` (A) from one temperature of the calibration to the other the skin alone has changed: by
    the conductivity, and by the duty, as the coil has `resistance` (ohm) at 20 degC.
    """
    c = compensation
    shift, curve = c.reluctance_shift, curves.inductance_of_gap
    gap = min(max(gap, shift.low, curve.low), shift.high, curve.high)
    cold, warm = (
        float(skin_shape(bridge, duty(resistance_at(resistance, celsius), rest_current, bridge.link_voltage)))
        for celsius in (c.calibration_celsius, c.reference_celsius)
    )
    change = (1.0 + skin_change(c, c.reference_celsius)) * warm / cold - 1.0
    return 1.0 / float(evaluate(curve, gap)) - float(evaluate(shift, gap)) / change


_TERMS = 24  # chosen: the sum is right to 1e-5 by then
