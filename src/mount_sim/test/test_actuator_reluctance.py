"""The simulated magnet: published figures, the laws of its circuit, and how near it comes to Table 1."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.quantity import with_values
from mount_sim.plant.reluctance import (
    MU_0,
    ReluctanceActuator,
    core_flux_density,
    differential_permeability,
    force,
    force_and_gap_slope,
    gap_flux_density,
    mean_incremental_inductance,
)

MAGNET = ReluctanceActuator()
CURRENTS = (0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
FORCES = {
    250: (6.90, 42.24, 156.30, 277.40, 329.40, 347.98, 357.10),
    349: (4.03, 24.90, 96.12, 197.44, 277.75, 310.71, 324.25),
    450: (2.62, 16.24, 63.63, 137.14, 218.64, 270.93, 292.50),
    550: (1.84, 11.45, 45.17, 99.09, 166.75, 228.24, 261.41),
}

gaps = st.floats(200e-6, 700e-6)


@pytest.mark.parametrize('gap_um', FORCES)
def test_force_meets_the_published_table(gap_um):
    forces = [force(MAGNET, current, gap_um * 1e-6) for current in CURRENTS]
    assert forces == pytest.approx(FORCES[gap_um], abs=0.0051)


@settings(deadline=None)
@given(current=st.floats(0.05, 3.0), gap=gaps)
def test_the_slope_over_the_gap_is_that_of_the_force(current, gap):
    value, slope = force_and_gap_slope(MAGNET, current, gap)
    difference = force(MAGNET, current, gap + 1e-8) - force(MAGNET, current, gap - 1e-8)
    assert value == pytest.approx(force(MAGNET, current, gap), rel=1e-12)
    assert slope == pytest.approx(difference / 2e-8, rel=1e-5)


@settings(deadline=None)
@given(current=st.floats(0.05, 3.0), gap=gaps)
def test_the_slow_inductance_is_the_slope_of_the_flux_linkage(current, gap):
    def linkage(value):
        return MAGNET.turns * MAGNET.gap_area * core_flux_density(MAGNET, value, gap)

    slope = (linkage(current + 1e-5) - linkage(current - 1e-5)) / 2e-5
    assert mean_incremental_inductance(MAGNET, current, gap) == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize('gap_um', [250, 349, 550])
def test_far_below_saturation_the_force_is_that_of_equations_1_and_2(gap_um):
    magnet = with_values(MAGNET, leakage_permeance=0.0, residual_gap=0.0)
    gap, current = gap_um * 1e-6, 1e-4
    relative_permeability = differential_permeability(magnet, 0.0) / MU_0
    density = MU_0 * magnet.turns * current / (2.0 * gap + magnet.core_length / relative_permeability)
    expected = 2.0 * magnet.gap_area / (2.0 * MU_0) * density**2
    assert force(magnet, current, gap) == pytest.approx(expected, rel=1e-3)
    assert gap_flux_density(magnet, current, gap) == pytest.approx(density, rel=1e-3)
