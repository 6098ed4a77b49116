"""What the supply does to the ripple's inductance, and how a reading is carried to the supply of the curves.

The bridge holds a mean current by its duty D = (1 + R i / U) / 2. The longer it was at plus before, the more
of the ripple's field is still in the skin of the iron when the sample is taken, so D decides how much
reluctance the ripple meets there: with the same gap and current L_i falls with R / U. The share of the skin
in 1 / L_i is known from the calibration at a second temperature, where it changes by the conductivity.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.coil.gap import GapCurves, evaluate
from mount_models.coil.resistance import resistance_at
from mount_models.coil.temperature import TemperatureCompensation, skin_change
from mount_models.quantity import Quantity

FloatArray = npt.NDArray[np.float64]


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
