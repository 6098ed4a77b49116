"""Linear part of the friction contact (Fig. 6), and whether coefficients of friction fit it."""

from typing import Annotated, NamedTuple

import numpy as np

from mount_models.friction.coefficient import (
    FrictionCoefficients,
    offset_coefficient,
    slope_coefficient,
)
from mount_models.friction.simplified import FADED_BELOW
from mount_models.quantity import LawRefusedError, Quantity

HIGHEST_AT_ALL = 20.0
"""mu of both pads that is simulated and controlled (chosen): only numbers that went astray have more."""
HIGHEST_SPEED = 1.0
"""m/s, where the damper characteristics end."""
HIGHEST_NORMAL_FORCE = 500.0
"""N, chosen: more than the magnet presses with at 3 A."""
_FORCES = np.linspace(0.0, HIGHEST_NORMAL_FORCE, 101)


class FrictionContact(NamedTuple):
    """Spring c_Re in series with c_R parallel to d_R; the deflection of the parallel pair is xi.

    The paper prints no values. These are chosen: sticking gives way within 0.1 mm, xi creeps with
    d_R / c_R = 0.5 s, as its text suggests (good fit for times above 1 s).
    """

    tangential_stiffness: Annotated[
        float, Quantity('N/m', 'c_R: spring of the creeping element', 1e4, 1e9)
    ] = 1.0e7
    tangential_damping: Annotated[
        float, Quantity('N s/m', 'd_R: damper of the creeping element', 1e2, 1e9)
    ] = 5.0e6
    contact_stiffness: Annotated[
        float, Quantity('N/m', 'c_Re: spring between the mount and the creeping element', 1e4, 1e9)
    ] = 4.0e6


def check_friction(coefs: FrictionCoefficients, contact: FrictionContact) -> None:
    """Raise `LawRefusedError` unless friction stays finite and positive wherever it can come to be.

    That is at any normal force, at speeds from where it is not faded to the end of the characteristics, and
    at any deflection xi of the contact. With mu = a + b u the equation of the creeping element (Eqs 8 and 9),
    d_R xi' = F_N (a + b u) - c_R xi, has an end only if F_N b stays below c_R: mu = a c_R / (c_R - F_N b).
    """
    low, high = coefs.lowest_normal_force, coefs.highest_normal_force
    if low > high:
        raise LawRefusedError(
            f'lowest_normal_force ({low:g} N) must not exceed highest_normal_force ({high:g} N); '
            'exchange them, or identify again'
        )
    stiffness = contact.tangential_stiffness
    for speed in (FADED_BELOW, coefs.slope_velocity_limit, HIGHEST_SPEED):
        for velocity in (speed, -speed):
            for force in _FORCES:
                pull = coefs.scale * force * float(slope_coefficient(coefs, velocity, force))
                where = f'at {1e3 * velocity:+.3g} mm/s and {force:g} N'
                if not pull < stiffness:
                    raise LawRefusedError(
                        f'normal force times slope b of the friction ({pull:.3g} N/m {where}) must stay '
                        f'below tangential_stiffness ({stiffness:g} N/m) of the contact, or its deflection '
                        'grows without end; set b_offset, b_1, b_2, beta_1, beta_2 and scale closer to '
                        'their defaults'
                    )
                if speed < FADED_BELOW:
                    continue  # the limit of b lies there; mu is faded
                rest = coefs.scale * float(offset_coefficient(coefs, velocity, force))
                mu = rest * stiffness / (stiffness - pull)
                if not 0.0 < mu <= HIGHEST_AT_ALL:
                    raise LawRefusedError(
                        f'coefficient of friction ({mu:.3g} {where}) must be greater than 0 and not exceed '
                        f'{HIGHEST_AT_ALL:g}; set the parameters a_*, alpha_* and b_* of the friction closer '
                        'to their defaults'
                    )
