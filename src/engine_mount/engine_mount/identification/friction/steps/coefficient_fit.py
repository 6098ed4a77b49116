"""Step 3: Eqs (13), (14) through the lines of step 2, on products that are identifiable.

As printed, nine numbers of a (and six of b) have scales that no measurement tells apart: (a_1, a_2) against
(alpha_1, alpha_2), (b_1, b_2) against (beta_1, beta_2). Here alpha and beta are 1 at 100 N:

    a = [A_1 + A_2 ln(A_3 + |v|)] [1 + s (F_N - 100 N)]      for each direction, |v| in mm/s
    b = b_offset + (B_1 + B_2 |v|) [1 + s_b (F_N - 100 N)]

Compare a and b with other results, not these numbers one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from engine_mount.identification.friction.recording import FloatArray, IdentificationError
from engine_mount.identification.friction.steps.sawtooth import StrokeLine
from engine_mount.identification.single_threaded import single_threaded
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


@dataclass(frozen=True)
class ProductCovariance:
    """Covariance (P, P) of the numbers that were fitted together, by the names of `FrictionCoefficients`.

    With alpha_2 or beta_2 goes alpha_1 or beta_1, which is 1 - 100 N times it. What was not fitted has 0.
    """

    names: tuple[str, ...]
    covariance: FloatArray


@dataclass(frozen=True)
class CoefficientFit:
    """Parameters of Eqs (12)-(14), and how they meet the lines: rms of a (1) and of b (1/mm).

    `with_load` tells whether more than one normal force was there; without, nothing depends on F_N.
    `variant` names the form of b that was fitted.
    """

    coefficients: FrictionCoefficients
    variant: str
    with_load: bool
    a_rms: float
    b_rms_mm: float
    covariances: tuple[ProductCovariance, ...]


@single_threaded
def fit_coefficients(lines: Sequence[StrokeLine], variant: str = 'full') -> CoefficientFit:
    """Return the coefficients for the lines of step 2.

    `variant`: 'full' as above, 'unloaded slope' with s_b = 0, 'constant slope' with b = b_offset. Raises
    `IdentificationError` for one direction only or too few speeds.
    """
    _check_coverage(lines)
    loads = np.array([line.normal_force for line in lines])
    with_load = float(np.ptp(loads)) > _SAME_LOAD * float(loads.mean())
    values: dict[str, float] = {}
    covariances = []
    for side, sign in (('p', 1.0), ('n', -1.0)):
        one_way = [line for line in lines if line.velocity * sign > 0.0]
        found, covariance = _offset_values(one_way, side, with_load)
        values.update(found)
        covariances.append(covariance)
    found, covariance = _slope_values(lines, variant, with_load)
    values.update(found)
    covariances.append(covariance)
    speeds = [abs(line.velocity) for line in lines]
    fitted = FrictionCoefficients(
        **values,
        slope_velocity_limit=float(max(speeds)),
        lowest_normal_force=float(loads.min()),
        highest_normal_force=float(loads.max()),
    )
    a = np.array([offset_coefficient(fitted, line.velocity, line.normal_force) for line in lines])
    b = np.array([slope_coefficient(fitted, line.velocity, line.normal_force) for line in lines])
    return CoefficientFit(
        fitted,
        variant,
        with_load,
        float(np.sqrt(np.mean((a - [line.a for line in lines]) ** 2))),
        1e-3 * float(np.sqrt(np.mean((b - [line.b for line in lines]) ** 2))),
        tuple(covariances),
    )


VARIANTS = ('full', 'unloaded slope', 'constant slope')


def _check_coverage(lines: Sequence[StrokeLine]) -> None:
    for side, sign, other in (('positive', 1.0, 'negative'), ('negative', -1.0, 'positive')):
        speeds = sorted(abs(line.velocity) for line in lines if line.velocity * sign > 0.0)
        if not speeds:
            raise IdentificationError(
                f'only strokes to the {other} side ({len(lines)} strokes, 0 to the {side}); both are needed, '
                'for each has parameters of its own: record strokes to and fro'
            )
        distinct = 1
        reference = speeds[0]
        for speed in speeds:
            if speed > reference * (1.0 + _SAME_SPEED):
                distinct, reference = distinct + 1, speed
        if distinct < FEWEST_SPEEDS or speeds[-1] < SPEED_SPREAD * speeds[0]:
            raise IdentificationError(
                f'{distinct} speeds to the {side} side, {1e3 * speeds[0]:.3g} .. {1e3 * speeds[-1]:.3g} '
                f'mm/s; at least {FEWEST_SPEEDS} are needed, the highest {SPEED_SPREAD:g} times the lowest '
                'or more: record more speeds'
            )


def _offset_values(
    lines: Sequence[StrokeLine], side: str, with_load: bool
) -> tuple[dict[str, float], ProductCovariance]:
    speed = np.array([1e3 * abs(line.velocity) for line in lines])
    load = np.array([line.normal_force for line in lines]) - NORMALISED_AT
    a = np.array([line.a for line in lines])
    weight = 1.0 / np.hypot(_TYPICAL_A, [line.a_deviation for line in lines])

    def residuals(unknowns: FloatArray) -> FloatArray:
        level, gain, shift, rise = unknowns
        factor = 1.0 + (0.01 * rise * load if with_load else 0.0)
        return np.asarray(((level + gain * np.log(shift + speed)) * factor - a) * weight)

    spread = max(float(a.mean()), 0.05)
    (level, gain, shift, rise), covariance = _best(
        residuals,
        [[spread, 0.3 * spread, shift, rise] for shift in (0.1, 0.4, 1.5) for rise in (0.1, 0.4)],
        [-5.0, 1e-4, 1e-3, 0.0],
        [5.0, 5.0, 10.0, 0.9],
    )
    rise = rise if with_load else 0.0
    found = {
        f'a_{side}1': level,
        f'a_{side}2': gain,
        f'a_{side}3': shift,
        f'alpha_{side}1': 1.0 - 0.01 * rise * NORMALISED_AT,
        f'alpha_{side}2': 0.01 * rise,
    }
    names = (f'a_{side}1', f'a_{side}2', f'a_{side}3', f'alpha_{side}2')
    return found, _named(names, covariance)


def _slope_values(
    lines: Sequence[StrokeLine], variant: str, with_load: bool
) -> tuple[dict[str, float], ProductCovariance]:
    speed = np.array([1e3 * abs(line.velocity) for line in lines])
    load = np.array([line.normal_force for line in lines]) - NORMALISED_AT
    b = np.array([1e-3 * line.b for line in lines])
    weight = 1.0 / np.hypot(_TYPICAL_B_MM, [1e-3 * line.b_deviation for line in lines])
    loaded = with_load and variant == 'full'

    def residuals(unknowns: FloatArray) -> FloatArray:
        offset, first, second, rise = unknowns
        if variant == 'constant slope':
            return np.asarray((offset - b) * weight)
        factor = 1.0 + (0.01 * rise * load if loaded else 0.0)
        # without different loads b_offset and B_1 are one number
        return np.asarray(((offset if loaded else 0.0) + (first + second * speed) * factor - b) * weight)

    (offset, first, second, rise), covariance = _best(
        residuals,
        [[offset, -10.0, -1.0, rise] for offset in (10.0, -10.0) for rise in (0.2, 0.8)],
        [-30.0, -100.0, -10.0, -2.0],
        [30.0, 100.0, 10.0, 2.0],
    )
    if variant == 'constant slope':
        first, second = 0.0, 0.0
    elif not loaded:
        offset = 0.0
    rise = rise if loaded else 0.0
    found = {
        'b_offset': offset,
        'b_1': first,
        'b_2': second,
        'beta_1': 1.0 - 0.01 * rise * NORMALISED_AT,
        'beta_2': 0.01 * rise,
    }
    return found, _named(('b_offset', 'b_1', 'b_2', 'beta_2'), covariance)


def _best(residuals, starts, low, high) -> tuple[list[float], FloatArray]:
    """Return the best end of searches from all `starts`, and its covariance by the scatter left over."""
    found = [least_squares(residuals, start, bounds=(low, high), x_scale='jac') for start in starts]
    best = min(found, key=lambda each: each.cost)
    told = np.linalg.norm(best.jac, axis=0)
    scale = np.where(told > 0.0, told, 1.0)
    freedom = max(1, best.fun.size - int(np.count_nonzero(told)))
    scatter = float(best.fun @ best.fun) / freedom
    inverse = np.linalg.pinv((best.jac / scale).T @ (best.jac / scale), hermitian=True)
    return [float(value) for value in best.x], scatter * inverse / np.outer(scale, scale)


def _named(names: tuple[str, ...], covariance: FloatArray) -> ProductCovariance:
    factor = np.array([1.0, 1.0, 1.0, 0.01])  # alpha_2, beta_2 are fitted per 100 N
    return ProductCovariance(names, covariance * np.outer(factor, factor))
