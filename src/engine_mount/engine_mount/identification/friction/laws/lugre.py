"""The LuGre law: bristles with a Stribeck curve (Canudas de Wit and others, 1995)."""

from collections.abc import Sequence

import numpy as np

from engine_mount.identification.friction.laws.law import (
    LawParameter,
    level,
    levels,
    typical_force,
    typical_stroke,
)
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import Quantity


class LuGre:
    """z' = v - sigma_0 |v| z / g(v), F = sigma_0 z + sigma_1 z' + sigma_2 v.

    g = mu F_N [1 + s exp(-(v / v_s)^2)]: s above 0 is a Stribeck effect, below 0 a rise with speed.
    """

    name = 'LuGre'
    parameters: tuple[LawParameter, ...] = (
        level('positive'),
        level('negative'),
        LawParameter('sigma_0', Quantity('N/m', 'stiffness of the bristles', 1e2, 1e10)),
        LawParameter('sigma_1', Quantity('N s/m', 'damping of the bristles', 0.0, 1e7), logarithmic=False),
        LawParameter('sigma_2', Quantity('N s/m', 'viscous part', 0.0, 1e8), logarithmic=False),
        LawParameter(
            's', Quantity('1', 'excess of static over sliding friction', -0.9, 4.0), logarithmic=False
        ),
        LawParameter('v_s', Quantity('m/s', 'speed over which static friction fades', 1e-5, 1.0)),
    )

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return levels, a stiffness as of Dahl's law, little damping and no Stribeck effect."""
        force, stroke = typical_force(recordings), typical_stroke(recordings)
        speed = max(float(np.abs(np.diff(each.displacement)).max()) / each.dt for each in recordings)
        return np.array(
            [
                *levels(recordings),
                20.0 * force / stroke,
                0.01 * force / speed,
                0.02 * force / speed,
                0.05,
                np.clip(0.2 * speed, 2e-5, 0.9),
            ]
        )

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        return lugre_force(*(float(value) for value in values), displacement, dt, normal_force)


@compiled
def lugre_force(mu_p, mu_n, sigma_0, sigma_1, sigma_2, excess, fading, displacement, dt, normal_force):
    """Return the force; the bristles are integrated exactly over each sample of constant velocity."""
    force = np.zeros(displacement.size)
    z = 0.0
    for k in range(1, displacement.size):
        velocity = (displacement[k] - displacement[k - 1]) / dt
        limit = mu_p * normal_force[k, 0] if velocity >= 0.0 else mu_n * normal_force[k, 1]
        limit *= 1.0 + excess * np.exp(-((velocity / fading) ** 2))
        rest = limit / sigma_0 if velocity >= 0.0 else -limit / sigma_0
        new = rest + (z - rest) * np.exp(-sigma_0 * abs(velocity) * dt / limit)
        force[k] = sigma_0 * new + sigma_1 * (new - z) / dt + sigma_2 * velocity
        z = new
    return force
