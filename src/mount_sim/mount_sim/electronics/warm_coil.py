"""Coil and core of the simulated truth at another temperature than 20 degC."""

from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity
from mount_sim.plant.ripple import RippleCoil

REFERENCE_CELSIUS = 20.0
"""Temperature at which the parameters of the truth hold."""


class TemperatureCoefficients(NamedTuple):
    """How the truth changes with the temperature; a calibration may well assume something else."""

    core: Annotated[
        float,
        Quantity(
            '1/K', 'rise of the resistivity of the core per kelvin from 20 degC on', 0.0, 0.01, 'chosen'
        ),
    ] = 0.0043
    copper: Annotated[
        float,
        Quantity('1/K', 'rise of the resistance of the coil per kelvin from 20 degC on', 0.0, 0.01, 'chosen'),
    ] = 0.0039


def coil_at(coil: RippleCoil, coefficients: TemperatureCoefficients, celsius: float) -> RippleCoil:
    """Return coil and core plates, given at 20 degC, as they are at `celsius` (degC)."""
    warmer = celsius - REFERENCE_CELSIUS
    return coil._replace(
        conductivity=coil.conductivity / (1.0 + coefficients.core * warmer),
        resistance=coil.resistance * (1.0 + coefficients.copper * warmer),
    )
