"""Dahl's law: a spring that yields into Coulomb friction."""

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


class Dahl:
    """dF/dx = sigma (1 - sign(v) F / (mu F_N)): Dahl's law with exponent 1."""

    name = 'Dahl'
    parameters: tuple[LawParameter, ...] = (
        level('positive'),
        level('negative'),
        LawParameter('sigma', Quantity('N/m', 'stiffness at the turn of the motion', 1e2, 1e10)),
    )

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return levels, and a stiffness that yields within a twentieth of the stroke."""
        return np.array([*levels(recordings), 20.0 * typical_force(recordings) / typical_stroke(recordings)])

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        return dahl_force(values[0], values[1], values[2], displacement, normal_force)


@compiled
def dahl_force(mu_p, mu_n, stiffness, displacement, normal_force):
    """Return the force; exact for straight motion between samples."""
    force = np.zeros(displacement.size)
    for k in range(1, displacement.size):
        way = displacement[k] - displacement[k - 1]
        limit = mu_p * normal_force[k, 0] if way >= 0.0 else -mu_n * normal_force[k, 1]
        force[k] = limit + (force[k - 1] - limit) * np.exp(-stiffness * abs(way) / abs(limit))
    return force
