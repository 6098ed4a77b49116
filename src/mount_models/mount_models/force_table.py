"""What the controller makes of its gap estimates: contact force, offset current and the current-force table.

Everything here uses the fitted law of `actuator.law`; the simulated truth is `closing`.
"""

import numpy as np
import numpy.typing as npt

from mount_models.actuator.law import ForceLaw, checked_current_for_force, checked_force
from mount_models.sampling import HIGHEST_CURRENT

FloatArray = npt.NDArray[np.float64]


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
    step: float = 0.5,
) -> FloatArray:
    """Return the current-force table, shape (2, N): rows current (A) and normal force on the pads (N).

    Both rows rise strictly, from the contact current at 0 N in steps of `step` (N) to `current_high` (A). The
    spring's share is subtracted and the pads' compression included: at normal force F_N the gap is
    d = d_c - F_N / k_p and the magnet pulls F_N + k_s (d_rest - d).
    Raises `ForceTableError`, or `OutsideLawError` where the law does not reach.
    """
    if not step > 0.0:
        raise ForceTableError(f'step ({step:g} N) must be positive; 0.5 N is usual')
    contact_force(spring_stiffness, rest_gap, contact_gap)
    highest = _highest_normal_force(law, spring_stiffness, pad_stiffness, rest_gap, contact_gap, current_high)
    normal_force = np.append(np.arange(0.0, highest - 0.01 * step, step), highest)
    gap = contact_gap - normal_force / pad_stiffness
    current = checked_current_for_force(law, normal_force + spring_stiffness * (rest_gap - gap), gap)
    current[-1] = current_high
    return checked_table(np.stack([current, normal_force]))


def checked_table(table: npt.ArrayLike) -> FloatArray:
    """Return `table` as an array (2, N) whose rows rise strictly from 0 N, or raise `ForceTableError`."""
    rows = np.asarray(table, float)
    if rows.ndim != 2 or rows.shape[0] != 2 or rows.shape[1] < 2:
        raise ForceTableError(
            f'current-force table must have shape (2, N >= 2); instead received {rows.shape}'
        )
    if not np.isfinite(rows).all():
        raise ForceTableError('current-force table must be finite; initialise the actuator again')
    for name, row in zip(('current', 'normal force'), rows, strict=True):
        falls = np.flatnonzero(np.diff(row) <= 0.0)
        if falls.size:
            k = int(falls[0])
            raise ForceTableError(
                f'{name} of the current-force table must rise strictly; entries {k} and {k + 1} are '
                f'{row[k]:g} and {row[k + 1]:g}: initialise the actuator again'
            )
    if rows[0, 0] < 0.0 or rows[1, 0] != 0.0:
        raise ForceTableError(
            f'current-force table must start at 0 N and a current of 0 A or more; instead it starts at '
            f'{rows[1, 0]:g} N and {rows[0, 0]:g} A'
        )
    return rows


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
