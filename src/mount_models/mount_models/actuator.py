"""The electromagnet as the controller knows it: force law (Eqs 3, 4, Table 1), its inverse and its check.

With gap estimates it becomes contact force, offset current and current-force table.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import atan
from mount_models.arrays import FloatArray
from mount_models.quantity import LawRefusedError, OutsideLawError, Quantity
from mount_models.sampling import HIGHEST_CURRENT

LOWEST_SHARE = 1.0 / 60.0
"""Of the highest current, chosen: 0.05 A of 3 A."""

_POLYNOMIAL = 'polynomial coefficients in powers of the gap in micrometres, lowest power first'


class ForceLaw(NamedTuple):
    """Eqs (3), (4): F = (a1 + a2 i) [atan(a3 a4) + atan(a3 (i - a4))] + a5 i^2 [atan(a3 a4) - atan(...)].

    Inside the polynomials the gap is in micrometres, as in Table 1; every argument and result is SI.
    The law is meaningful only between `gap_low` and `gap_high` and from 0 to `current_high`.
    """

    a1: Annotated[tuple[float, ...], Quantity('N', f'offset of the saturated line: {_POLYNOMIAL}')]
    a2: Annotated[tuple[float, ...], Quantity('N/A', f'slope of the saturated line: {_POLYNOMIAL}')]
    a3: Annotated[tuple[float, ...], Quantity('1/A', f'sharpness of the knee: {_POLYNOMIAL}')]
    a4: Annotated[tuple[float, ...], Quantity('A', f'current at the knee: {_POLYNOMIAL}')]
    a5: Annotated[tuple[float, ...], Quantity('N/A^2', f'curvature of the parabola: {_POLYNOMIAL}')]
    gap_low: Annotated[float, Quantity('m', 'smallest guarded air gap', 1e-6, 5e-3)]
    gap_high: Annotated[float, Quantity('m', 'largest guarded air gap', 1e-6, 5e-3)]
    current_high: Annotated[float, Quantity('A', 'largest guarded coil current', 0.1, 20.0)]


TABLE_1 = ForceLaw(
    a1=(70.2, -0.157, 5.84e-4, -9.77e-7),
    a2=(77.2, -0.305, 5.28e-4, -2.58e-7),
    a3=(20.7, -0.11, 2.3e-4, -1.59e-7),
    a4=(-8.9e-3, 4.6e-3),
    a5=(354.0, -2.21, 5e-3, -3.85e-6),
    gap_low=200e-6,
    gap_high=520e-6,
    current_high=3.0,
)
"""The authors' prototype as printed in Table 1; the guarded range lies well within the hard limits."""


@compiled
def force(law, current, gap):
    """Return the magnetic force (N) at `current` (A) and `gap` (m), Eq (3); NaN outside the guarded range."""
    if not (_gap_inside(law, gap) and _current_inside(law, current)):
        return math.nan
    return _force_and_slope(coefficients(law, gap), current)[0]


@compiled
def current_for_force(law, force, gap):
    """Return the current (A) that gives `force` (N) at `gap` (m), to 1e-9 A; NaN where there is none.

    Inverse of Eq (3), which has no closed form: Newton's steps, kept inside a shrinking bracket.
    """
    if not (_gap_inside(law, gap) and force >= 0.0):
        return math.nan
    if force == 0.0:
        return 0.0
    a = coefficients(law, gap)
    low, high = 0.0, law.current_high
    highest_force = _force_and_slope(a, high)[0]
    if not force <= highest_force * (1.0 + _ROUNDING):
        return math.nan
    current = high * math.sqrt(force / highest_force)
    for _ in range(_MOST_STEPS):
        reached, slope = _force_and_slope(a, current)
        if reached > force:
            high = current
        else:
            low = current
        following = current - (reached - force) / slope
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - current) < _CURRENT_RESOLUTION:
            return following
        current = following
    return current


@compiled
def coefficients(law, gap):
    """Return a1 .. a5 at `gap` (m), Eq (4)."""
    gap_um = gap * 1e6
    return (
        _polynomial(law.a1, gap_um),
        _polynomial(law.a2, gap_um),
        _polynomial(law.a3, gap_um),
        _polynomial(law.a4, gap_um),
        _polynomial(law.a5, gap_um),
    )


def checked_force(law: ForceLaw, current: npt.ArrayLike, gap: npt.ArrayLike) -> FloatArray:
    """Return the magnetic force (N) for currents (A) and gaps (m) of any shapes that broadcast, Eq (3).

    Raises `OutsideLawError`; nothing is ever extrapolated.
    """
    current, gap = np.broadcast_arrays(np.asarray(current, float), np.asarray(gap, float))
    check_gap(law, gap)
    force = _each_force(law, current.ravel(), gap.ravel()).reshape(gap.shape)
    outside = np.isnan(force)
    if outside.any():
        raise OutsideLawError(
            f'coil current ({float(current[outside].flat[0]):.3f} A) must lie within 0.000 .. '
            f'{law.current_high:.3f} A; beyond it the force law was never fitted: limit the current'
        )
    return force[()]


def checked_current_for_force(law: ForceLaw, force: npt.ArrayLike, gap: npt.ArrayLike) -> FloatArray:
    """Return the current (A) for forces (N) and gaps (m) of any shapes that broadcast, inverse of Eq (3).

    Raises `OutsideLawError`, also for a force that is negative or beyond `current_high`.
    """
    force, gap = np.broadcast_arrays(np.asarray(force, float), np.asarray(gap, float))
    check_gap(law, gap)
    current = _each_current(law, force.ravel(), gap.ravel()).reshape(gap.shape)
    unreachable = np.isnan(current)
    if unreachable.any():
        value, place = float(force[unreachable][0]), float(gap[unreachable][0])
        raise OutsideLawError(
            f'magnetic force ({value:.2f} N) must lie within 0.00 .. '
            f'{_force_and_slope(coefficients(law, place), law.current_high)[0]:.2f} N, which '
            f'{law.current_high:.2f} A reach at an air gap of {place * 1e6:.1f} um; demand less force, '
            f'or make the gap smaller'
        )
    return current[()]


def check_gap(law: ForceLaw, gap: npt.ArrayLike) -> None:
    """Raise `OutsideLawError` unless every gap (m) lies in the guarded range of `law`."""
    gap = np.asarray(gap, float)
    inside = (gap >= law.gap_low - _GAP_ROUNDING) & (gap <= law.gap_high + _GAP_ROUNDING)
    if not inside.all():
        value = float(gap[~inside].flat[0])
        raise OutsideLawError(
            f'air gap ({value * 1e6:.1f} um) must lie within {law.gap_low * 1e6:.1f} .. '
            f'{law.gap_high * 1e6:.1f} um; beyond it the force law is not valid: check the gap measurement, '
            f'or calibrate the actuator over a wider range of gaps'
        )


def check_force_law(law: ForceLaw) -> None:
    """Raise `LawRefusedError` unless `law` can be inverted everywhere within its guarded range.

    Looked at on 61 gaps and 119 currents from 1/60 of the highest up; below, the force is next to nothing.
    """
    if not (0.0 < law.gap_low < law.gap_high and law.current_high > 0.0):
        raise LawRefusedError(
            f'guarded range ({law.gap_low * 1e6:.1f} .. {law.gap_high * 1e6:.1f} um, '
            f'0 .. {law.current_high:.2f} A) must hold gaps above 0 in rising order '
            'and currents above 0 A'
        )
    gaps = np.linspace(law.gap_low, law.gap_high, 61)
    currents = np.linspace(LOWEST_SHARE * law.current_high, law.current_high, 119)
    forces = checked_force(law, currents, gaps[:, np.newaxis])
    # written so that NaN fails each of them
    _refuse_where(~(forces > 0.0), gaps, currents, 'be positive')
    _refuse_where(~(np.diff(forces, axis=1) > 0.0), gaps, currents, 'rise with current')
    _refuse_where(~(np.diff(forces, axis=0) < 0.0), gaps, currents, 'fall with the air gap')


_ROUNDING = 1e-12
_GAP_ROUNDING = 1e-12  # m: 546 * 1e-6 and 546e-6 differ by a rounding, no more
_CURRENT_RESOLUTION = 1e-10  # A
_MOST_STEPS = 80


@compiled
def _force_and_slope(a, current):
    """Return Eq (3) in N and its derivative with respect to current in N/A, from a1 .. a5 at one gap."""
    a1, a2, a3, a4, a5 = a
    knee = atan(a3 * a4)
    reach = a3 * (current - a4)
    bend = atan(reach)
    bend_slope = a3 / (1.0 + reach * reach)
    line = a1 + a2 * current
    parabola = a5 * current * current
    force = line * (knee + bend) + parabola * (knee - bend)
    slope = a2 * (knee + bend) + 2.0 * a5 * current * (knee - bend) + (line - parabola) * bend_slope
    return force, slope


@compiled
def _polynomial(coefficients, x):
    value = 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        value = value * x + coefficients[k]
    return value


@compiled
def _gap_inside(law, gap):
    return law.gap_low - _GAP_ROUNDING <= gap <= law.gap_high + _GAP_ROUNDING


@compiled
def _current_inside(law, current):
    return 0.0 <= current <= law.current_high * (1.0 + _ROUNDING)


@compiled
def _each_force(law, current, gap):
    result = np.empty(gap.size)
    for k in range(gap.size):
        result[k] = force(law, current[k], gap[k])
    return result


@compiled
def _each_current(law, force, gap):
    result = np.empty(gap.size)
    for k in range(gap.size):
        result[k] = current_for_force(law, force[k], gap[k])
    return result


def _refuse_where(failed: npt.NDArray[np.bool_], gaps: FloatArray, currents: FloatArray, what: str) -> None:
    if failed.any():
        row, column = np.argwhere(failed)[0]
        raise LawRefusedError(
            f'the force must {what}; at {gaps[row] * 1e6:.0f} um and {currents[column]:.2f} A this law does '
            f'not: narrow its range of gaps, measure more points, or look for outliers'
        )


_STEP = 0.5  # N, chosen


class ForceTableError(ValueError):
    """A current-force table cannot be built; the text says why and the remedy."""


def zero_current_rest_gap(
    law: ForceLaw, spring_stiffness: float, gap_at_rest_current: float, rest_current: float
) -> float:
    """Return the gap (m) at 0 A from that measured at `rest_current` (A), which already closes it a little.

    Derived: d_rest = d + F(i, d) / k_s; the 492 um of section 3.2 are measured at 0.2 A.
    """
    return (
        gap_at_rest_current + float(checked_force(law, rest_current, gap_at_rest_current)) / spring_stiffness
    )


def contact_force(spring_stiffness: float, rest_gap: float, contact_gap: float) -> float:
    """Return the magnetic force F_c = k_s (d_rest - d_c) (N) at which the pads just touch."""
    if not rest_gap > contact_gap:
        raise ForceTableError(
            f'contact gap ({contact_gap * 1e6:.1f} um) must lie below the rest gap '
            f'({rest_gap * 1e6:.1f} um); measure both again: the pads may be stuck to the rod'
        )
    return spring_stiffness * (rest_gap - contact_gap)


def offset_current(
    law: ForceLaw, spring_stiffness: float, rest_gap: float, contact_gap: float, light_pressure: float
) -> float:
    """Return the current (A) of the ready position, `light_pressure` (N) past just touching (section 3.2)."""
    wanted = contact_force(spring_stiffness, rest_gap, contact_gap) + light_pressure
    return float(checked_current_for_force(law, wanted, contact_gap))


def current_force_table(
    law: ForceLaw,
    spring_stiffness: float,
    pad_stiffness: float,
    rest_gap: float,
    contact_gap: float,
    current_high: float = HIGHEST_CURRENT,
) -> FloatArray:
    """Return the current-force table, shape (2, N): rows current (A) and normal force on the pads (N).

    Both rows rise strictly, from the contact current at 0 N in steps of 0.5 N to `current_high` (A). The
    spring's share is subtracted and the pads' compression included: at normal force F_N the gap is
    d = d_c - F_N / k_p and the magnet pulls F_N + k_s (d_rest - d).
    Raises `ForceTableError`, or `OutsideLawError` where the law does not reach.
    """
    contact_force(spring_stiffness, rest_gap, contact_gap)
    highest = _highest_normal_force(law, spring_stiffness, pad_stiffness, rest_gap, contact_gap, current_high)
    normal_force = np.append(np.arange(0.0, highest - 0.01 * _STEP, _STEP), highest)
    gap = contact_gap - normal_force / pad_stiffness
    current = checked_current_for_force(law, normal_force + spring_stiffness * (rest_gap - gap), gap)
    current[-1] = current_high
    table = np.stack([current, normal_force])
    if not (np.diff(table) > 0.0).all():  # also where it is not a number
        raise ForceTableError('current-force table must rise strictly; initialise the actuator again')
    return table


def _highest_normal_force(
    law: ForceLaw,
    spring_stiffness: float,
    pad_stiffness: float,
    rest_gap: float,
    contact_gap: float,
    current: float,
) -> float:
    """Return the normal force (N) at `current` (A): the magnet's pull less the spring's, pads compressed."""
    normal_force = 0.0
    for _ in range(50):  # each step is some thirty times smaller than the one before
        gap = contact_gap - normal_force / pad_stiffness
        following = float(checked_force(law, current, gap)) - spring_stiffness * (rest_gap - gap)
        if not following > 0.0:
            raise ForceTableError(
                f'current_high ({current:.2f} A) must close the pads; it leaves {-following:.1f} N of the '
                f'spring unbalanced at {gap * 1e6:.1f} um: check both gap estimates, or allow more current'
            )
        if abs(following - normal_force) < 1e-9:
            break
        normal_force = following
    return normal_force
