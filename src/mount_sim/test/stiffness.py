"""Dynamic stiffness and natural frequencies, by which tests judge the laws of the plant."""

import numpy as np
import numpy.typing as npt

from mount_sim.plant.vehicle import Elastomer, Vehicle

FloatArray = npt.NDArray[np.float64]


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


def modes(vehicle: Vehicle, mount_stiffness: float | None = None) -> FloatArray:
    """Return the four undamped natural frequencies (Hz); `mount_stiffness` in N/m, k_e if not given."""
    mount = vehicle.elastomer.static_stiffness if mount_stiffness is None else mount_stiffness
    springs = (vehicle.tyre_stiffness, vehicle.suspension_stiffness, vehicle.chassis_stiffness, mount)
    masses = np.array([vehicle.wheel_mass, vehicle.body_mass, vehicle.chassis_mass, vehicle.engine_mass])
    stiffness = np.diag(np.array(springs) + np.array([*springs[1:], 0.0]))
    for lower, spring in enumerate(springs[1:]):
        stiffness[lower, lower + 1] = stiffness[lower + 1, lower] = -spring
    scale = 1.0 / np.sqrt(masses)
    squares = np.linalg.eigvalsh(stiffness * np.outer(scale, scale))
    return np.asarray(np.sqrt(squares) / (2.0 * np.pi), dtype=np.float64)
