"""The paper's model as a rung: the full model, Eqs (7), (8), with the coefficient of Eqs (12) to (14)."""

from collections.abc import Sequence

import numpy as np

from engine_mount.identification.fitting import FloatArray
from engine_mount.identification.friction.coefficients import NORMALISED_AT
from engine_mount.identification.friction.laws import (
    FrictionLaw,
    Parameter,
    friction_levels,
    simple_laws,
    typical_stiffness,
)
from engine_mount.identification.friction.recording import FrictionRecording
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_sim.plant.friction import full_step

_LOAD_SPREAD = 0.05
"""Loads that differ by less (of their mean) do not determine how mu depends on them."""


def all_laws(
    training: Sequence[FrictionRecording], known: tuple[FrictionContact, FrictionCoefficients] | None = None
) -> list[FrictionLaw]:
    """Return the rungs from below; `known`, the result of steps 1 to 3, starts the search of the last."""
    return [*simple_laws(training), pad_law(training, known)]


def pad_law(
    training: Sequence[FrictionRecording], known: tuple[FrictionContact, FrictionCoefficients] | None
) -> FrictionLaw:
    """Return the paper's model on products that are identifiable (see `coefficients`).

    Loads and speeds are related to those of the training: alpha and beta are 1 at the mean load, do not
    change beyond the lowest and the highest, and stay 1 where only one load was trained.
    """
    loads = [float(each.normal_force.mean()) for each in training]
    reference, lowest, highest = float(np.mean(loads)), min(loads), max(loads)
    with_load = highest - lowest > _LOAD_SPREAD * reference
    top_speed = max(
        float(np.percentile(np.abs(np.diff(each.displacement)) / each.dt, 99)) for each in training
    )

    def simulate(
        values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        *of_a, s_p, s_n, b_offset, b_1, b_2, s_b, c_r, d_r, c_re = (float(value) for value in values)
        if not with_load:
            s_p = s_n = s_b = 0.0
        coefs = FrictionCoefficients(
            **dict(zip(_OF_A, of_a, strict=True)),
            alpha_p1=1.0 - s_p,
            alpha_p2=s_p / reference,
            alpha_n1=1.0 - s_n,
            alpha_n2=s_n / reference,
            b_offset=b_offset,
            b_1=b_1,
            b_2=b_2,
            beta_1=1.0 - s_b,
            beta_2=s_b / reference,
            slope_velocity_limit=min(top_speed, 0.01),
            lowest_normal_force=lowest,
            highest_normal_force=highest,
        )
        return pad_force(FrictionContact(c_r, d_r, c_re), coefs, displacement, dt, normal_force)

    rise = 0.95 if with_load else 1e-9
    of_a = [
        parameter
        for side in 'pn'
        for parameter in (
            Parameter(f'A_{side}1', '1', -5.0, 1e6, False),
            Parameter(f'A_{side}2', '1', 1e-4, 1e5),
            Parameter(f'A_{side}3', '1', 1e-3, 10.0),
        )
    ]
    parameters = (
        *of_a,
        Parameter('s_p', '1', 0.0, rise, False),
        Parameter('s_n', '1', 0.0, rise, False),
        Parameter('b_offset', '1/mm', -30.0, 30.0, False),
        Parameter('B_1', '1/mm', -100.0, 100.0, False),
        Parameter('B_2', 's/mm^2', -10.0, 10.0, False),
        Parameter('s_b', '1', -2.0 * rise, 2.0 * rise, False),
        Parameter('c_R', 'N/m', 1e2, 1e10),
        Parameter('d_R', 'N s/m', 1e1, 1e10),
        Parameter('c_Re', 'N/m', 1e2, 1e10),
    )
    if known is not None:
        start = _start_at(*known, reference, with_load)
    else:
        first, stiffness = 0.3 if with_load else 0.0, typical_stiffness(training)
        logarithm = 0.1 * np.log(0.3 + 0.5e3 * top_speed)
        sides = [[level * (1.0 - logarithm), level * 0.1, 0.3] for level in friction_levels(training)]
        springs = [5.0 * stiffness, 2.5 * stiffness, stiffness]
        start = [*sides[0], *sides[1], first, first, 0.0, -0.01, 0.0, 0.0, *springs]
    return FrictionLaw("paper's model", parameters, np.array(start), simulate)


_OF_A = ('a_p1', 'a_p2', 'a_p3', 'a_n1', 'a_n2', 'a_n3')


def _start_at(
    contact: FrictionContact, coefs: FrictionCoefficients, reference: float, with_load: bool
) -> list[float]:
    """Return the result of steps 1 to 3 in the parameters of the law."""
    load = NORMALISED_AT + (reference - NORMALISED_AT if with_load else 0.0)

    def factors(first: float, second: float) -> tuple[float, float]:
        at_reference = first + second * load
        return at_reference, second * reference / at_reference if with_load else 0.0

    up, s_p = factors(coefs.alpha_p1, coefs.alpha_p2)
    down, s_n = factors(coefs.alpha_n1, coefs.alpha_n2)
    slope, s_b = factors(coefs.beta_1, coefs.beta_2)
    return [
        *(up * coefs.a_p1, up * coefs.a_p2, coefs.a_p3, down * coefs.a_n1, down * coefs.a_n2, coefs.a_n3),
        *(s_p, s_n, coefs.b_offset, slope * coefs.b_1, slope * coefs.b_2, s_b, *contact),
    ]


@compiled
def pad_force(contact, coefs, displacement, dt, normal_force):
    """Return the force of the full model; each direction of sliding has its own normal force."""
    force = np.zeros(displacement.size)
    slider = displacement[0]
    xi = 0.0
    for k in range(1, displacement.size):
        new, new_slider, new_xi, _ = full_step(
            contact, coefs, slider, xi, displacement[k], normal_force[k, 0], dt
        )
        if new < 0.0 and normal_force[k, 1] != normal_force[k, 0]:
            new, new_slider, new_xi, _ = full_step(
                contact, coefs, slider, xi, displacement[k], normal_force[k, 1], dt
            )
        force[k], slider, xi = new, new_slider, new_xi
    return force
