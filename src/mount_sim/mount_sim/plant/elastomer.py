"""Elastomer spring of the mount: a static spring and three Maxwell branches (all values chosen).

F = k_e x + f_1 + f_2 + f_3;  f_j' = k_j x' - f_j / tau_j,  tau_j = 1 / (2 pi corner frequency)
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1
from mount_models.quantity import Quantity


class Elastomer(NamedTuple):
    """Static stiffness k_e, stiffness k_j and corner frequency of each branch; loss factor 0.06 .. 0.08."""

    static_stiffness: Annotated[float, Quantity('N/m', 'k_e: stiffness at rest', 1e3, 1e7)] = 1.6e5
    slow_stiffness: Annotated[float, Quantity('N/m', 'k_1 of the slow branch', 0.0, 1e7)] = 1.6e4
    middle_stiffness: Annotated[float, Quantity('N/m', 'k_2 of the middle branch', 0.0, 1e7)] = 1.6e4
    fast_stiffness: Annotated[float, Quantity('N/m', 'k_3 of the fast branch', 0.0, 1e7)] = 1.6e4
    slow_corner: Annotated[float, Quantity('Hz', 'corner frequency of the slow branch', 0.01, 1e3)] = 2.0
    middle_corner: Annotated[float, Quantity('Hz', 'corner frequency of the middle branch', 0.01, 1e3)] = 10.0
    fast_corner: Annotated[float, Quantity('Hz', 'corner frequency of the fast branch', 0.01, 1e3)] = 50.0


@compiled
def elastomer_force(elastomer, displacement, branch_forces):
    """Return the force (N) at `displacement` (m) with `branch_forces` (slow, middle, fast) in N."""
    slow, middle, fast = branch_forces
    return elastomer.static_stiffness * displacement + slow + middle + fast


@compiled
def branch_step(elastomer, branch_forces, displacement_change, dt):
    """Return the branch forces (slow, middle, fast) in N after `dt` seconds with `displacement_change` in m.

    Exact for a constant velocity within the step.
    """
    slow, middle, fast = branch_forces
    return (
        _maxwell_step(slow, elastomer.slow_stiffness, elastomer.slow_corner, displacement_change, dt),
        _maxwell_step(middle, elastomer.middle_stiffness, elastomer.middle_corner, displacement_change, dt),
        _maxwell_step(fast, elastomer.fast_stiffness, elastomer.fast_corner, displacement_change, dt),
    )


def dynamic_stiffness(elastomer: Elastomer, frequency: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """Return storage (real) and loss (imaginary) stiffness in N/m at `frequency` (Hz, any shape)."""
    hertz = np.asarray(frequency, float)
    stiffness = np.full(hertz.shape, elastomer.static_stiffness, complex)
    for branch, corner in (
        (elastomer.slow_stiffness, elastomer.slow_corner),
        (elastomer.middle_stiffness, elastomer.middle_corner),
        (elastomer.fast_stiffness, elastomer.fast_corner),
    ):
        turn = 1j * hertz / corner
        stiffness += branch * turn / (1.0 + turn)
    return stiffness


@compiled
def _maxwell_step(force, stiffness, corner, displacement_change, dt):
    exponent = 2.0 * math.pi * corner * dt
    lost = -expm1(-exponent)
    return force * (1.0 - lost) + stiffness * displacement_change * lost / exponent
