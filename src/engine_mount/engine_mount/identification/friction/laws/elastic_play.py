"""Coulomb friction behind a spring with play: a device with backlash.

What lies between the moved end and the sliding contact (links, a band, bearings) is a spring that transmits
nothing within +-g. After each turn the force falls along the spring, lingers near zero while the play is
crossed, and rises on the other side until the contact slides. The play moves along with the slider.
"""

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


class ElasticPlay:
    """F = k (z - g) beyond the play, 0 within, |F| at most mu F_N; z is what the joint is stretched by."""

    name = 'Coulomb + elastic play'
    parameters: tuple[LawParameter, ...] = (
        level('positive'),
        level('negative'),
        LawParameter('k', Quantity('N/m', 'stiffness on either side of the play', 1e2, 1e10)),
        LawParameter('g', Quantity('m', 'half of the play', 0.0, 1.0), logarithmic=False),
    )

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return levels, and a stiffness and a play that take some of the stroke."""
        force, stroke = typical_force(recordings), typical_stroke(recordings)
        return np.array([*levels(recordings), 20.0 * force / stroke, 0.02 * stroke])

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        return elastic_play_force(values[0], values[1], values[2], values[3], displacement, normal_force)


@compiled
def elastic_play_force(mu_p, mu_n, stiffness, play, displacement, normal_force):
    """Return the force; exact for any step."""
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
