"""Coil and core of the truth at their temperature."""

import numpy as np
import pytest

from mount_sim.electronics.electronics import ElectronicsParameters, Noise
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.plant import Plant, PlantSimulation
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients, coil_at

COIL = RippleCoil()


def test_core_and_copper_follow_their_own_coefficients():
    warm = coil_at(COIL, TemperatureCoefficients(core=0.002, copper=0.004), 70.0)
    assert warm.conductivity == pytest.approx(COIL.conductivity / 1.1)
    assert warm.resistance == pytest.approx(COIL.resistance * 1.2)
    assert warm._replace(conductivity=COIL.conductivity, resistance=COIL.resistance) == COIL


def test_the_plant_reads_its_ripple_at_its_temperature():
    def slope(**changes):
        plant = Plant(electronics=ElectronicsParameters(coil_temperature=70.0), **changes)
        return PlantSimulation(plant, Seat.BENCH, 1e-4).read(np.zeros(Noise.NUMBERS))[2]

    told = slope(temperature=TemperatureCoefficients(core=0.002, copper=0.0))
    more = slope(temperature=TemperatureCoefficients(core=0.004, copper=0.0))
    assert more < told  # a core that conducts less has more inductance
