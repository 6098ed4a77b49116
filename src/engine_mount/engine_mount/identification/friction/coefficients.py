"""Step 3: Eqs (13), (14) through the lines of step 2, on products that are identifiable; their validation.

As printed, nine numbers of a (and six of b) have scales that no measurement separates: (a_1, a_2) against
(alpha_1, alpha_2), (b_1, b_2) against (beta_1, beta_2). Here alpha and beta are 1 at 100 N:

    a = [A_1 + A_2 ln(A_3 + |v|)] [1 + s (F_N - 100 N)]      for each direction, |v| in mm/s
    b = b_offset + (B_1 + B_2 |v|) [1 + s_b (F_N - 100 N)]

Compare a and b with other results, not these numbers one by one.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from engine_mount.identification.fitting import (
    FloatArray,
    IdentificationError,
    covariance_of,
    rms,
    single_threaded,
)
from engine_mount.identification.friction.sawtooth import StrokeLine
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient, slope_coefficient

NORMALISED_AT = 100.0
FEWEST_SPEEDS = 4
"""In each direction: A_1, A_2, A_3 and one more."""
SPEED_SPREAD = 2.0
_SAME_SPEED = 0.15  # of the speed: closer ones count as one
_SAME_LOAD = 0.05
_TYPICAL_A = 0.005
"""Error of a that the form of Eq (14) is allowed (chosen): noise alone would trust long strokes too much."""
_TYPICAL_B_MM = 0.3
_OFFSET_BOUNDS = [-5.0, 1e-4, 1e-3, 0.0], [5.0, 5.0, 10.0, 0.9]
_SLOPE_BOUNDS = [-30.0, -100.0, -10.0, -2.0], [30.0, 100.0, 10.0, 2.0]
_PER_100_N = np.array([1.0, 1.0, 1.0, 0.01])  # rises with the load are fitted per 100 N


class CoefficientFit(NamedTuple):
    """Parameters of Eqs (12)-(14), and how they meet the lines: rms of a (1) and of b (1/mm).

    `covariances` holds for the numbers that were fitted together, by their names in `FrictionCoefficients`,
    their covariance (4, 4); with alpha_2 or beta_2 goes alpha_1 or beta_1, which is 1 - 100 N times it. What
    was not fitted has 0.
    """

    coefficients: FrictionCoefficients
    a_rms: float
    b_rms_mm: float
    covariances: dict[tuple[str, ...], FloatArray]


@single_threaded
def fit_coefficients(lines: Sequence[StrokeLine]) -> CoefficientFit:
    """Return the coefficients for the lines of step 2.

    Without different loads nothing depends on F_N. Raises `IdentificationError` for one direction only or too
    few speeds.
    """
    _check_coverage(lines)
    loads = np.array([line.normal_force for line in lines])
    with_load = np.ptp(loads) > _SAME_LOAD * loads.mean()
    unloaded = [] if with_load else [3]
    fits = {}
    for side, sign in (('p', 1.0), ('n', -1.0)):
        one_way = [line for line in lines if line.velocity * sign > 0.0]
        spread = max(float(np.mean([line.a for line in one_way])), 0.05)
        starts = [[spread, 0.3 * spread, shift, rise] for shift in (0.1, 0.4, 1.5) for rise in (0.1, 0.4)]
        fits[f'a_{side}1', f'a_{side}2', f'a_{side}3', f'alpha_{side}2'] = _fit(
            one_way, 'a', 1.0, _TYPICAL_A, _offset, starts, _OFFSET_BOUNDS, unloaded
        )
    starts = [[offset, -10.0, -1.0, rise] for offset in (10.0, -10.0) for rise in (0.2, 0.8)]
    # without different loads b_offset and B_1 are one number
    unloaded = [] if with_load else [0, 3]
    fits['b_offset', 'b_1', 'b_2', 'beta_2'] = _fit(
        lines, 'b', 1e-3, _TYPICAL_B_MM, _slope, starts, _SLOPE_BOUNDS, unloaded
    )
    values: dict[str, float] = {}
    for names, ((*others, rise), _) in fits.items():
        rise *= 0.01
        values |= zip(names, (*others, rise), strict=True)
        values[names[3].replace('2', '1')] = 1.0 - rise * NORMALISED_AT
    fitted = FrictionCoefficients(
        **values,
        slope_velocity_limit=max(abs(line.velocity) for line in lines),
        lowest_normal_force=float(loads.min()),
        highest_normal_force=float(loads.max()),
    )
    a_rms, b_rms = (
        rms([form(fitted, each.velocity, each.normal_force) - getattr(each, name) for each in lines])
        for name, form in (('a', offset_coefficient), ('b', slope_coefficient))
    )
    return CoefficientFit(fitted, a_rms, 1e-3 * b_rms, {names: found[1] for names, found in fits.items()})


def _check_coverage(lines: Sequence[StrokeLine]) -> None:
    for side, sign, other in (('positive', 1.0, 'negative'), ('negative', -1.0, 'positive')):
        speeds = sorted(abs(line.velocity) for line in lines if line.velocity * sign > 0.0)
        if not speeds:
            raise IdentificationError(
                f'only strokes to the {other} side ({len(lines)} strokes, 0 to the {side}); both are needed, '
                'for each has parameters of its own: record strokes to and fro'
            )
        distinct = speeds[:1]
        for speed in speeds:
            if speed > distinct[-1] * (1.0 + _SAME_SPEED):
                distinct.append(speed)
        if len(distinct) < FEWEST_SPEEDS or speeds[-1] < SPEED_SPREAD * speeds[0]:
            raise IdentificationError(
                f'{len(distinct)} speeds to the {side} side, {1e3 * speeds[0]:.3g} .. {1e3 * speeds[-1]:.3g} '
                f'mm/s; at least {FEWEST_SPEEDS} are needed, the highest {SPEED_SPREAD:g} times the lowest '
                'or more: record more speeds'
            )


def _offset(unknowns: FloatArray, speed: FloatArray, rise: FloatArray) -> FloatArray:
    """Return a by A_1, A_2, A_3 at speeds (mm/s), with its rise with the load."""
    return (unknowns[0] + unknowns[1] * np.log(unknowns[2] + speed)) * rise


def _slope(unknowns: FloatArray, speed: FloatArray, rise: FloatArray) -> FloatArray:
    """Return b (1/mm) by b_offset, B_1, B_2 at speeds (mm/s), with its rise with the load."""
    return unknowns[0] + (unknowns[1] + unknowns[2] * speed) * rise


def _fit(
    lines: Sequence[StrokeLine],
    name: str,
    factor: float,
    typical: float,
    form: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    starts: list[list[float]],
    bounds: tuple[list[float], list[float]],
    unloaded: list[int],
) -> tuple[list[float], FloatArray]:
    """Return the unknowns of `form` and the rise per 100 N, and their covariance, by searches from `starts`.

    `name` is a or b, times `factor` with an error of `typical`; unknowns that are `unloaded` are 0, for only
    different loads tell them.
    """
    speed = np.array([1e3 * abs(line.velocity) for line in lines])
    load = np.array([line.normal_force for line in lines]) - NORMALISED_AT
    values, deviations = (
        np.array([factor * getattr(line, each) for line in lines]) for each in (name, f'{name}_deviation')
    )
    weight = 1.0 / np.hypot(typical, deviations)

    def residuals(unknowns: FloatArray) -> FloatArray:
        known = unknowns.copy()
        known[unloaded] = 0.0
        return (form(known, speed, 1.0 + 0.01 * known[3] * load) - values) * weight

    ends = [least_squares(residuals, start, bounds=bounds, x_scale='jac') for start in starts]
    best = min(ends, key=lambda end: end.cost)
    best.x[unloaded] = 0.0
    return best.x.tolist(), covariance_of(best) * np.outer(_PER_100_N, _PER_100_N)
