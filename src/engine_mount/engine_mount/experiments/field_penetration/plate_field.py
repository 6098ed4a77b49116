"""The ripple's field inside a plate of the core, in one dimension: how far it has come when it is sampled.

The series of `coil.ripple` for the reluctance is that of the surface; this is the same solution in depth.
It belongs to the plant.
"""

import numpy as np
import numpy.typing as npt

from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, diffusion_time, duty

FloatArray = npt.NDArray[np.float64]

_TERMS = 2000
"""Terms of the series: they fall with the square of their number, so the rest is below 1e-3 of the first."""


def flux_density_change(
    coil: RippleCoil,
    actuator: ReluctanceActuator,
    current: float,
    permeability: float,
    depth: npt.ArrayLike,
    time: float,
) -> FloatArray:
    """Return by how much the flux density (T) at each `depth` (m) has changed `time` (s) after switching.

    Derived: in a plate of half thickness a, B obeys B_t = B_xx / (mu sigma) with the mean's rate e(t)
    imposed, so B = mean + 2 sum_k (-1)^k cos(k pi x / a) c_k, c_k' = -l_k c_k + e(t), l_k = (k pi)^2 / tau,
    in the periodic steady state; x is counted from the middle. `depth` is counted from the surface, any
    shape; `time` must lie within the positive phase. `permeability` is dB/dH (H/m) at the mean field.
    """
    plus, period = duty(coil, current), coil.pwm_period
    if not 0.0 <= time <= plus * period:
        raise ValueError(
            f'time after switching ({time * 1e6:.1f} us) must lie within the positive phase, 0.0 .. '
            f'{plus * period * 1e6:.1f} us at {current:.2f} A'
        )
    depths = np.asarray(depth, float)
    tau = diffusion_time(coil, permeability)
    number = np.arange(1, _TERMS + 1)
    rates = (number * np.pi) ** 2 / tau
    swing = 2.0 * coil.link_voltage / (actuator.turns * actuator.gap_area)
    # c_k'(0+) = swing (1 - exp(-l (1-D) T)) / (1 - exp(-l T)): what all switchings of the past leave
    slope = swing * np.expm1(-rates * (1.0 - plus) * period) / np.expm1(-rates * period)
    change = slope * -np.expm1(-rates * time) / rates
    # (-1)^k cos(k pi (a - depth) / a) = cos(k pi depth / a)
    shape = np.cos(np.multiply.outer(depths / coil.plate_half_thickness, number * np.pi))
    return np.asarray(swing * (1.0 - plus) * time + 2.0 * shape @ change, np.float64)


def equivalent_depth(depth: FloatArray, change: FloatArray) -> float:
    """Return the depth (m) that would take the whole change at its surface value.

    It is the integral of `change` over its first value; `depth` (m) rises from 0 at the surface to the
    middle of the plate; both of shape (n,).
    """
    return float(np.trapezoid(change, depth) / change[0])
