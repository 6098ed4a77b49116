"""Coulomb friction, alone and with a viscous part: force by direction of motion only."""

from collections.abc import Sequence

import numpy as np

from engine_mount.identification.friction.laws.law import LawParameter, level, levels, typical_force
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import Quantity

_SMALLEST_SPEED = 1e-4
"""m/s (chosen): below it the sign of the velocity fades, or noise at rest would switch the force."""


class Coulomb:
    """F = sign(v) mu F_N, with one mu for each direction."""

    name = 'Coulomb'
    parameters: tuple[LawParameter, ...] = (level('positive'), level('negative'))

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return mu of both directions."""
        return np.array(levels(recordings))

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        return coulomb_force(values[0], values[1], 0.0, displacement, dt, normal_force)


class CoulombViscous:
    """F = sign(v) mu F_N + d v."""

    name = 'Coulomb + viscous'
    parameters: tuple[LawParameter, ...] = (
        level('positive'),
        level('negative'),
        LawParameter('d', Quantity('N s/m', 'viscous part', 0.0, 1e8), logarithmic=False),
    )

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return mu of both directions, and a tenth of the force as the viscous part."""
        speed = max(float(np.abs(np.diff(each.displacement)).max()) / each.dt for each in recordings)
        return np.array([*levels(recordings), 0.1 * typical_force(recordings) / speed])

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        return coulomb_force(values[0], values[1], values[2], displacement, dt, normal_force)


@compiled
def coulomb_force(mu_p, mu_n, damping, displacement, dt, normal_force):
    """Return sign(v) mu F_N + d v, the sign faded below a small speed."""
    force = np.zeros(displacement.size)
    for k in range(1, displacement.size):
        velocity = (displacement[k] - displacement[k - 1]) / dt
        limit = mu_p * normal_force[k, 0] if velocity >= 0.0 else mu_n * normal_force[k, 1]
        force[k] = np.tanh(velocity / _SMALLEST_SPEED) * limit + damping * velocity
    return force
