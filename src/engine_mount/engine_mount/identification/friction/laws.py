"""The rungs of the ladder: friction laws of rising complexity, each a row of parameters and a simulation.

A simulation takes (values, displacement (m, (n,)), dt (s), normal_force (N, (n, 2))), the normal force for
sliding to the positive and to the negative side, and returns the force (N, (n,)) of a contact that begins
free of force at the first displacement.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from engine_mount.identification.fitting import FloatArray
from engine_mount.identification.friction.coefficients import NORMALISED_AT
from engine_mount.identification.friction.recording import FrictionRecording
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_sim.plant.friction import full_step

_LOAD_SPREAD = 0.05
"""Loads that differ by less (of their mean) do not determine how mu depends on them."""
_OF_A = ('a_p1', 'a_p2', 'a_p3', 'a_n1', 'a_n2', 'a_n3')
_SMALLEST_SPEED = 1e-4
"""m/s (chosen): below it the sign of the velocity fades, or noise at rest would switch the force."""


class Parameter(NamedTuple):
    """One parameter: its unit, its bounds, and whether the search counts it by its logarithm."""

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = True


@dataclass(frozen=True)
class FrictionLaw:
    """A law that predicts friction force from displacement and normal force alone.

    `start` are first values of its parameters, by the size of strokes and forces of the training.
    """

    name: str
    parameters: tuple[Parameter, ...]
    start: FloatArray
    simulate: Callable[[FloatArray, FloatArray, float, FloatArray], FloatArray]


def simple_laws(training: Sequence[FrictionRecording]) -> list[FrictionLaw]:
    """Return the laws of the literature, from Coulomb to elastic play, with starts for `training`."""
    levels, stiffness = friction_levels(training), typical_stiffness(training)
    force = max(each.force_rms for each in training)
    stroke = max(np.ptp(each.displacement) for each in training)
    speed = max(np.abs(np.diff(each.displacement)).max() / each.dt for each in training)
    # friction over normal force, sliding to either side
    mu = (Parameter('mu_p', '1', 1e-3, 1e6), Parameter('mu_n', '1', 1e-3, 1e6))
    viscous = Parameter('d', 'N s/m', 0.0, 1e8, False)
    lugre = (
        Parameter('sigma_0', 'N/m', 1e2, 1e10),
        Parameter('sigma_1', 'N s/m', 0.0, 1e7, False),
        viscous._replace(name='sigma_2'),
        Parameter('s', '1', -0.9, 4.0, False),
        Parameter('v_s', 'm/s', 1e-5, 1.0),
    )
    bristles = (stiffness, 0.01 * force / speed, 0.02 * force / speed, 0.05, np.clip(0.2 * speed, 2e-5, 0.9))
    joint = (Parameter('k', 'N/m', 1e2, 1e10), Parameter('g', 'm', 0.0, 1.0, False))
    rows = (
        ('Coulomb', (), (), coulomb_force),
        ('Coulomb + viscous', (viscous,), (0.1 * force / speed,), coulomb_force),
        ('Dahl', (Parameter('sigma', 'N/m', 1e2, 1e10),), (stiffness,), dahl_force),
        ('LuGre', lugre, bristles, lugre_force),
        ('Coulomb + elastic play', joint, (stiffness, 0.02 * stroke), elastic_play_force),
    )
    return [
        FrictionLaw(name, (*mu, *others), np.array([*levels, *start]), simulate)
        for name, others, start, simulate in rows
    ]


def friction_levels(recordings: Sequence[FrictionRecording]) -> tuple[float, float]:
    """Return |F| / F_N of both directions while sliding: the 70th percentile on each side of zero force."""
    levels = []
    for side, sign in enumerate((1.0, -1.0)):
        ratios = np.concatenate([sign * each.force / each.normal_force[:, side] for each in recordings])
        same = ratios[ratios > 0.0]
        levels.append(float(np.clip(np.percentile(same, 70) if same.size else 0.1, 2e-3, 9e5)))
    return levels[0], levels[1]


def typical_stiffness(recordings: Sequence[FrictionRecording]) -> float:
    """Return a stiffness (N/m) that yields within a twentieth of the stroke."""
    stroke = max(np.ptp(each.displacement) for each in recordings)
    return 20.0 * max(each.force_rms for each in recordings) / stroke


@compiled
def coulomb_force(values, displacement, dt, normal_force):
    """F = sign(v) mu F_N + d v, the sign faded below a small speed; `values` are mu_p, mu_n and maybe d."""
    damping = values[2] if values.size > 2 else 0.0
    force = np.zeros(displacement.size)
    for k in range(1, displacement.size):
        velocity = (displacement[k] - displacement[k - 1]) / dt
        limit = values[0] * normal_force[k, 0] if velocity >= 0.0 else values[1] * normal_force[k, 1]
        force[k] = np.tanh(velocity / _SMALLEST_SPEED) * limit + damping * velocity
    return force


@compiled
def dahl_force(values, displacement, dt, normal_force):
    """dF/dx = sigma (1 - sign(v) F / (mu F_N)): Dahl's law with exponent 1; exact for straight motion.

    `values` are mu_p, mu_n, sigma: a spring that yields into Coulomb friction.
    """
    force = np.zeros(displacement.size)
    for k in range(1, displacement.size):
        way = displacement[k] - displacement[k - 1]
        limit = values[0] * normal_force[k, 0] if way >= 0.0 else -values[1] * normal_force[k, 1]
        force[k] = limit + (force[k - 1] - limit) * np.exp(-values[2] * abs(way) / abs(limit))
    return force


@compiled
def lugre_force(values, displacement, dt, normal_force):
    """z' = v - sigma_0 |v| z / g(v), F = sigma_0 z + sigma_1 z' + sigma_2 v (Canudas de Wit, 1995).

    g = mu F_N [1 + s exp(-(v / v_s)^2)]: s above 0 is a Stribeck effect, below 0 a rise with speed. `values`
    are mu_p, mu_n, sigma_0, sigma_1, sigma_2, s, v_s. The bristles are integrated exactly over each sample of
    constant velocity.
    """
    mu_p, mu_n, sigma_0, sigma_1, sigma_2 = values[0], values[1], values[2], values[3], values[4]
    force = np.zeros(displacement.size)
    z = 0.0
    for k in range(1, displacement.size):
        velocity = (displacement[k] - displacement[k - 1]) / dt
        limit = mu_p * normal_force[k, 0] if velocity >= 0.0 else mu_n * normal_force[k, 1]
        limit *= 1.0 + values[5] * np.exp(-((velocity / values[6]) ** 2))
        rest = limit / sigma_0 if velocity >= 0.0 else -limit / sigma_0
        new = rest + (z - rest) * np.exp(-sigma_0 * abs(velocity) * dt / limit)
        force[k] = sigma_0 * new + sigma_1 * (new - z) / dt + sigma_2 * velocity
        z = new
    return force


@compiled
def elastic_play_force(values, displacement, dt, normal_force):
    """F = k (z - g) beyond the play, 0 within, |F| at most mu F_N; exact for any step.

    Coulomb friction behind a spring with play: what lies between the moved end and the sliding contact
    (links, a band, bearings) transmits nothing within +-g. z is the stretch of the joint, `values` are mu_p,
    mu_n, k, g. After each turn the force falls along the spring, stays at zero while the play is crossed, and
    rises on the other side until the contact slides. The play moves along with the slider.
    """
    mu_p, mu_n, stiffness, play = values[0], values[1], values[2], values[3]
    force = np.zeros(displacement.size)
    z = 0.0
    for k in range(1, displacement.size):
        z += displacement[k] - displacement[k - 1]
        z = min(z, play + mu_p * normal_force[k, 0] / stiffness)
        z = max(z, -play - mu_n * normal_force[k, 1] / stiffness)
        if z > play:
            force[k] = stiffness * (z - play)
        elif z < -play:
            force[k] = stiffness * (z + play)
    return force


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
    loads = [each.normal_force.mean() for each in training]
    reference, lowest, highest = float(np.mean(loads)), min(loads), max(loads)
    with_load = highest - lowest > _LOAD_SPREAD * reference
    top_speed = max(
        float(np.percentile(np.abs(np.diff(each.displacement)) / each.dt, 99)) for each in training
    )

    def simulate(
        values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        *of_a, s_p, s_n, b_offset, b_1, b_2, s_b, c_r, d_r, c_re = values.tolist()
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
