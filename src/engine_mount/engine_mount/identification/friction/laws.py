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
from engine_mount.identification.friction.recording import FrictionRecording
from mount_models.arithmetic.compiled import compiled

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
    stroke = max(float(np.ptp(each.displacement)) for each in training)
    speed = max(float(np.abs(np.diff(each.displacement)).max()) / each.dt for each in training)
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
    stroke = max(float(np.ptp(each.displacement)) for each in recordings)
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
