"""Dynamic stiffness and natural frequencies, by which tests judge the laws of the plant."""

import numpy as np
import numpy.typing as npt

from mount_sim.plant.vehicle import Elastomer


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
