"""Do identified coefficients of friction describe a brake lining at all, or has a file been spoiled?"""

from mount_models.friction.coefficient import FrictionCoefficients, dynamic_coefficient

LOWEST, HIGHEST = 0.05, 5.0
"""mu of both pads that is believed (chosen): linings have 0.4 .. 1.8, the controller's floor 0.05."""
SPEEDS = (0.01, 0.05)
"""m/s: the fastest strokes of the rack, and 1 mm at 8 Hz, at which the controller relies on them."""


class CoefficientsRefusedError(ValueError):
    """The coefficients contradict each other or give no plausible friction; the text says where."""


def check_coefficients(coefs: FrictionCoefficients) -> None:
    """Raise `CoefficientsRefusedError` unless mu is plausible both ways and over the normal force."""
    low, high = coefs.lowest_normal_force, coefs.highest_normal_force
    if low > high:
        raise CoefficientsRefusedError(
            f'lowest_normal_force ({low:g} N) must not exceed highest_normal_force ({high:g} N); '
            'exchange them, or identify again'
        )
    for speed in SPEEDS:
        for velocity in (speed, -speed):
            for load in (low, high):
                mu = float(dynamic_coefficient(coefs, velocity, 0.0, load))
                if not LOWEST <= mu <= HIGHEST:
                    raise CoefficientsRefusedError(
                        f'coefficient of friction ({mu:.3g} at {1e3 * velocity:+.0f} mm/s and {load:g} N) '
                        f'must lie within {LOWEST:g} .. {HIGHEST:g}; identify the friction again'
                    )
