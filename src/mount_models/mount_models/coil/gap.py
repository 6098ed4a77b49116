"""Air gap from the coil's ripple as the controller knows it: two calibrated curves, both ways (Fig 4).

At 0.2 A, where the halves rest, the gap follows from the incremental inductance; where the pads are in
contact it follows from the current at which the incremental inductance crosses 20 mH. Between these two
currents the same inductance belongs to several gaps, so it is used nowhere else (section 3.2).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arrays import FloatArray
from mount_models.quantity import LawRefusedError, OutsideLawError


class ScaledPolynomial(NamedTuple):
    """sum_k coefficients[k] ((x - centre) / scale)^k for x within low .. high; x and the value are SI."""

    centre: float
    scale: float
    coefficients: tuple[float, ...]
    low: float
    high: float


class GapCurves(NamedTuple):
    """The calibrated curves, each with its inverse, over the same range of gaps.

    L_0.2(gap) in H is `inductance_of_gap`, i_20(gap) in A is `crossing_current_of_gap` (section 3.2).
    """

    inductance_of_gap: ScaledPolynomial
    gap_of_inductance: ScaledPolynomial
    crossing_current_of_gap: ScaledPolynomial
    gap_of_crossing_current: ScaledPolynomial


def measured_inductance(
    turns_area: float, flux_rate: npt.ArrayLike, current_rate: npt.ArrayLike
) -> FloatArray:
    """Return L_i = n A (dB/dt) / (di/dt) (H) from `turns_area` n A (m^2), T/s and A/s; NaN where di/dt is 0.

    Eq (5) in its right form: as printed, di/dB is the inverse and lacks turns and area.
    """
    flux_rate, current_rate = np.broadcast_arrays(
        np.asarray(flux_rate, float), np.asarray(current_rate, float)
    )
    result = np.full(flux_rate.shape, np.nan)
    np.divide(turns_area * flux_rate, current_rate, out=result, where=current_rate != 0.0)
    return result[()]


def rest_gap_from_inductance(curves: GapCurves, inductance: npt.ArrayLike) -> FloatArray:
    """Return the air gap (m) from the inductance (H) at the rest current; raises `OutsideLawError`."""
    return _value(curves.gap_of_inductance, inductance, 'rest inductance', 'mH', 1e3)


def inductance_from_gap(curves: GapCurves, gap: npt.ArrayLike) -> FloatArray:
    """Return the inductance (H) at the rest current from the air gap (m); raises `OutsideLawError`."""
    return _value(curves.inductance_of_gap, gap, 'air gap', 'um', 1e6)


def gap_from_crossing_current(curves: GapCurves, current: npt.ArrayLike) -> FloatArray:
    """Return the air gap (m) from the current (A) of the 20 mH crossing; raises `OutsideLawError`."""
    return _value(curves.gap_of_crossing_current, current, 'crossing current', 'A', 1.0)


def crossing_current_from_gap(curves: GapCurves, gap: npt.ArrayLike) -> FloatArray:
    """Return the current (A) of the 20 mH crossing from the air gap (m); raises `OutsideLawError`."""
    return _value(curves.crossing_current_of_gap, gap, 'air gap', 'um', 1e6)


def gap_per_inductance(curves: GapCurves, inductance: npt.ArrayLike) -> FloatArray:
    """Return d(gap)/d(inductance) (m/H, negative) at the rest current, to carry a standard deviation over."""
    rest_gap_from_inductance(curves, inductance)  # refuses what lies outside the curve
    return slope(curves.gap_of_inductance, inductance)


def gap_per_crossing_current(curves: GapCurves, current: npt.ArrayLike) -> FloatArray:
    """Return d(gap)/d(crossing current) (m/A, positive), to carry a standard deviation over."""
    gap_from_crossing_current(curves, current)  # refuses what lies outside the curve
    return slope(curves.gap_of_crossing_current, current)


def check_gap_curves(curves: GapCurves, round_trip: float = 2e-6) -> None:
    """Raise `LawRefusedError` unless each curve is monotone and leads back within `round_trip` (m)."""
    for name, curve in zip(GapCurves._fields, curves, strict=True):
        _check_monotone(name, curve)
    for there, back in (
        (curves.inductance_of_gap, curves.gap_of_inductance),
        (curves.crossing_current_of_gap, curves.gap_of_crossing_current),
    ):
        gaps = np.linspace(there.low, there.high, 301)
        with np.errstate(over='ignore', invalid='ignore'):  # a number beyond all is refused as any other
            error = np.abs(evaluate(back, evaluate(there, gaps)) - gaps)
        if not error.max() <= round_trip:
            raise LawRefusedError(
                f'a gap curve and its inverse must agree within {round_trip * 1e6:.1f} um; they differ by '
                f'{error.max() * 1e6:.1f} um at {gaps[int(np.argmax(error))] * 1e6:.1f} um: calibrate again'
            )


def evaluate(polynomial: ScaledPolynomial, x: npt.ArrayLike) -> FloatArray:
    """Return the polynomial at `x` of any shape, without a look at its range."""
    z = (np.asarray(x, float) - polynomial.centre) / polynomial.scale
    return np.asarray(np.polynomial.polynomial.polyval(z, polynomial.coefficients), np.float64)[()]


def slope(polynomial: ScaledPolynomial, x: npt.ArrayLike) -> FloatArray:
    """Return the polynomial's derivative at `x` of any shape, without a look at its range."""
    z = (np.asarray(x, float) - polynomial.centre) / polynomial.scale
    derived = np.polynomial.polynomial.polyder(polynomial.coefficients)
    return np.asarray(np.polynomial.polynomial.polyval(z, derived) / polynomial.scale, np.float64)[()]


def _value(polynomial: ScaledPolynomial, x: npt.ArrayLike, name: str, unit: str, factor: float) -> FloatArray:
    x = np.asarray(x, float)
    rounding = 1e-9 * (polynomial.high - polynomial.low)
    inside = (x >= polynomial.low - rounding) & (x <= polynomial.high + rounding)
    if not inside.all():
        raise OutsideLawError(
            f'{name} ({float(x[~inside].flat[0]) * factor:.3f} {unit}) must lie within '
            f'{polynomial.low * factor:.3f} .. {polynomial.high * factor:.3f} {unit}, where the gap curves '
            f'are calibrated; check the coil ripple signals, or calibrate over a wider range of gaps'
        )
    return evaluate(polynomial, x)


def check_range_of(name: str, polynomial: ScaledPolynomial) -> None:
    """Raise `LawRefusedError` unless scale and range of a polynomial can be."""
    if not (polynomial.low < polynomial.high and polynomial.scale > 0.0):
        raise LawRefusedError(
            f'{name} must have a positive scale ({polynomial.scale:g}) and a range in rising order '
            f'({polynomial.low:g} .. {polynomial.high:g}); calibrate again'
        )


def _check_monotone(name: str, polynomial: ScaledPolynomial) -> None:
    check_range_of(name, polynomial)
    x = np.linspace(polynomial.low, polynomial.high, 301)
    steps = np.sign(slope(polynomial, x))
    falters = ~((steps == steps[0]) & (steps != 0.0))
    if falters.any():
        raise LawRefusedError(
            f'{name} must be monotone to tell gaps apart; it turns at {x[int(np.argmax(falters))]:.6g} (SI): '
            f'narrow the range of gaps'
        )
