"""The contract of a rung: named parameters with unit and bounds, and a compiled simulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from mount_models.quantity import Quantity


@dataclass(frozen=True)
class LawParameter:
    """One parameter: name, what it is, and whether the search counts it by its logarithm."""

    name: str
    quantity: Quantity
    logarithmic: bool = True


class FrictionLaw(Protocol):
    """A law that predicts friction force from displacement alone, given the normal force."""

    name: str
    parameters: tuple[LawParameter, ...]

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return first values of the parameters, by the size of strokes and forces."""
        ...

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the friction force (N, (n,)) for `displacement` (m, (n,)) sampled every `dt` s.

        `normal_force` (N, (n, 2)) counts for sliding to positive and to negative side. The contact starts
        free of force at the first displacement.
        """
        ...


def level(side: str) -> LawParameter:
    """Return the parameter that every law has once for each direction."""
    return LawParameter(
        f'mu_{side[0]}', Quantity('1', f'friction over normal force, sliding to the {side} side', 1e-3, 1e6)
    )


def levels(recordings: Sequence[FrictionRecording]) -> tuple[float, float]:
    """Return |F| / F_N of both directions while sliding: the 70th percentile on each side of zero force."""
    found = []
    for side, sign in enumerate((1.0, -1.0)):
        ratios = np.concatenate([sign * each.force / each.normal_force[:, side] for each in recordings])
        same = ratios[ratios > 0.0]
        found.append(float(np.percentile(same, 70)) if same.size else 0.1)
    return float(np.clip(found[0], 2e-3, 9e5)), float(np.clip(found[1], 2e-3, 9e5))


def typical_force(recordings: Sequence[FrictionRecording]) -> float:
    """Return the largest rms force of the recordings, N."""
    return max(each.force_rms for each in recordings)


def typical_stroke(recordings: Sequence[FrictionRecording]) -> float:
    """Return the largest range of displacement, m."""
    return max(float(np.ptp(each.displacement)) for each in recordings)
