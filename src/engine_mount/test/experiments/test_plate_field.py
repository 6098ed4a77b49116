"""The field of the ripple in depth: published depths, its own surface series, two dimensions against one."""

import numpy as np
import pytest

from engine_mount.experiments.field_penetration import equivalent_depth, flux_density_change
from engine_mount.experiments.plate_finite_elements import plate_field
from mount_sim.plant.reluctance import ReluctanceActuator, core_field, differential_permeability
from mount_sim.plant.ripple import (
    RippleCoil,
    diffusion_time,
    duty,
    flux_rate,
    penetration_depth,
    skin_factor,
)

COIL, MAGNET, GAP = RippleCoil(), ReluctanceActuator(), 349e-6
CURRENTS = (0.0, 1.0, 1.5, 2.0, 3.0)
DEPTH = np.linspace(0.0, COIL.plate_half_thickness, 1501)


def permeability(current):
    return differential_permeability(MAGNET, core_field(MAGNET, current, GAP))


def change(current, depth=DEPTH, time=COIL.sample_delay):
    return flux_density_change(COIL, MAGNET, current, permeability(current), depth, time)


@pytest.mark.parametrize(('current', 'depth_um'), [(0.0, 32), (1.0, 67), (1.5, 130), (2.0, 305), (3.0, 880)])
def test_the_field_comes_as_deep_as_published(current, depth_um):
    # printed in full micrometres, the last one in tens
    digits = 5.1 if depth_um == 880 else 0.51
    assert 1e6 * penetration_depth(COIL, permeability(current)) == pytest.approx(depth_um, abs=digits)


@pytest.mark.parametrize('current', CURRENTS)
def test_the_mean_over_the_plate_changes_as_the_voltage_imposes(current):
    mean = np.trapezoid(change(current), DEPTH) / DEPTH[-1]
    assert mean == pytest.approx(flux_rate(COIL, MAGNET, current) * COIL.sample_delay, rel=1e-3)


@pytest.mark.parametrize('current', CURRENTS)
def test_the_surface_changes_as_fast_as_the_skin_factor_says(current):
    dt = 1e-9
    later, sooner = (change(current, [0.0], COIL.sample_delay + s * dt)[0] for s in (1, -1))
    expected = skin_factor(COIL, diffusion_time(COIL, permeability(current)), duty(COIL, current))
    assert (later - sooner) / (2 * dt) / flux_rate(COIL, MAGNET, current) == pytest.approx(expected, rel=1e-4)


def test_the_change_begins_with_switching_and_a_time_outside_the_positive_phase_is_refused():
    assert np.abs(change(1.0, time=0.0)).max() == 0.0
    with pytest.raises(
        ValueError, match=r'time after switching \(150.0 us\) must lie within .* 0.0 .. 100.0 us'
    ):
        change(0.0, time=150e-6)


def test_two_dimensions_agree_with_one_where_the_plate_is_far_from_saturation():
    field = plate_field(COIL, MAGNET, 0.0, GAP, finest=8e-6, periods=2)
    one = equivalent_depth(DEPTH, change(0.0))
    assert field.mean_change == pytest.approx(flux_rate(COIL, MAGNET, 0.0) * COIL.sample_delay, rel=1e-6)
    assert field.equivalent_depth == pytest.approx(one, rel=0.03)
    assert field.depth[0] == 0.0
    assert (np.diff(field.depth) > 0.0).all()


def test_the_steady_field_reaches_the_mean_flux_density_of_the_circuit():
    field = plate_field(COIL, MAGNET, 1.0, GAP, finest=20e-6, periods=1)
    assert field.permeability == pytest.approx(permeability(1.0), rel=1e-4)
