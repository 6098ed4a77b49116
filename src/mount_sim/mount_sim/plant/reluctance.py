"""The simulated actuator: a magnetic circuit with a saturating core, which stands for the real magnet.

It belongs to the plant. The controller never sees it: it only knows the law that a calibration fits
to this actuator's force (`mount_models.actuator`).
"""

import math
from typing import Annotated, NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import Quantity

MU_0 = 4e-7 * math.pi
"""Permeability of vacuum, H/m."""

_FITTED = 'chosen: fitted to Table 1'


class ReluctanceActuator(NamedTuple):
    """Two core halves in series with two equal air gaps and a leakage path; Eqs (1), (2) with saturation.

    The core follows B = mu0 H + J_s H / (H_k + H), and its cross section equals that of one gap, A_g.
    Eq (2) is used in its dimensionally right form B = mu0 n i / (2 gap + l / mu_r), and A of Eq (1) is 2 A_g.
    """

    turns: Annotated[float, Quantity('1', 'turns n of the coil', 1.0, 1e5)] = 480.0
    gap_area: Annotated[
        float, Quantity('m^2', 'area A_g of one air gap and of the core', 1e-6, 1e-2, _FITTED)
    ] = 2.46e-4
    core_length: Annotated[float, Quantity('m', 'length l of the flux path in iron', 1e-3, 1.0, _FITTED)] = (
        0.12
    )
    saturation_polarisation: Annotated[
        float, Quantity('T', 'polarisation J_s that the core approaches', 0.1, 2.5, _FITTED)
    ] = 1.58
    knee_field: Annotated[
        float, Quantity('A/m', 'field H_k at which half of J_s is reached', 1.0, 1e5, _FITTED)
    ] = 178.0
    residual_gap: Annotated[
        float, Quantity('m', 'joints and rough faces d_0, added to the air gap', 0.0, 1e-3, _FITTED)
    ] = 60e-6
    leakage_permeance: Annotated[
        float, Quantity('Wb/A', 'flux P_l past the gaps per ampere turn', 0.0, 1e-5, _FITTED)
    ] = 7.2e-8


@compiled
def core_field(actuator, current, gap):
    """Return the mean field H (A/m) in the core at a steady `current` (A) and `gap` (m).

    It is the positive root of c H^2 + b H - P_t n i H_k = 0 from A_g B(H) = P_t (n i - l H).
    """
    permeance = gap_permeance(actuator, gap)
    drive = permeance * actuator.turns * abs(current)
    square = actuator.gap_area * MU_0 + permeance * actuator.core_length
    linear = square * actuator.knee_field + actuator.gap_area * actuator.saturation_polarisation - drive
    constant = drive * actuator.knee_field
    root = math.sqrt(linear * linear + 4.0 * square * constant)
    # this form of the root does not subtract nearly equal numbers where the core is unsaturated
    field = 2.0 * constant / (linear + root)
    return math.copysign(field, current)


@compiled
def core_flux_density(actuator, current, gap):
    """Return the mean flux density B (T) in the core at a steady `current` (A) and `gap` (m)."""
    field = core_field(actuator, current, gap)
    knee = actuator.knee_field + abs(field)
    return MU_0 * field + actuator.saturation_polarisation * field / knee


@compiled
def gap_flux_density(actuator, current, gap):
    """Return the flux density B_g (T) in the air gaps, leakage left out, at `current` (A) and `gap` (m)."""
    magnetomotive = actuator.turns * current - actuator.core_length * core_field(actuator, current, gap)
    return MU_0 * magnetomotive / (2.0 * (gap + actuator.residual_gap))


@compiled
def force(actuator, current, gap):
    """Return the magnetic force (N) between the halves at `current` (A) and `gap` (m), Eq (1), A = 2 A_g."""
    density = gap_flux_density(actuator, current, gap)
    return actuator.gap_area * density * density / MU_0


@compiled
def force_and_gap_slope(actuator, current, gap):
    """Return the magnetic force (N) and its derivative with respect to the gap (N/m, negative)."""
    field = core_field(actuator, current, gap)
    length = gap + actuator.residual_gap
    magnetomotive = actuator.turns * current - actuator.core_length * field
    permeance_slope = -MU_0 * actuator.gap_area / (2.0 * length * length)
    stiffness = actuator.gap_area * differential_permeability(actuator, field)
    stiffness += gap_permeance(actuator, gap) * actuator.core_length
    magnetomotive_slope = -actuator.core_length * permeance_slope * magnetomotive / stiffness
    scale = 0.25 * MU_0 * actuator.gap_area / (length * length)
    value = scale * magnetomotive * magnetomotive
    slope = 2.0 * scale * magnetomotive * (magnetomotive_slope - magnetomotive / length)
    return value, slope


@compiled
def differential_permeability(actuator, field):
    """Return dB/dH (H/m) of the core at `field` (A/m)."""
    knee = actuator.knee_field + abs(field)
    return MU_0 + actuator.saturation_polarisation * actuator.knee_field / (knee * knee)


@compiled
def mean_incremental_inductance(actuator, current, gap):
    """Return the slope of flux linkage over current (H) for slow changes, which reach all of the core."""
    permeability = differential_permeability(actuator, core_field(actuator, current, gap))
    reluctance = 1.0 / gap_permeance(actuator, gap)
    reluctance += actuator.core_length / (permeability * actuator.gap_area)
    return actuator.turns * actuator.turns / reluctance


@compiled
def gap_permeance(actuator, gap):
    """Return the permeance P_t (Wb/A) of both gaps in series and the leakage path beside them."""
    return MU_0 * actuator.gap_area / (2.0 * (gap + actuator.residual_gap)) + actuator.leakage_permeance
