"""The simulated rig carries noise as it should; the default specimen meets its targets."""

import numpy as np
import pytest

from engine_mount.experiments.harness.rack_recording import (
    RIG_CURRENTS,
    RIG_GAPS,
    measure_actuator,
)
from mount_models.coil.gap import (
    crossing_current_from_gap,
    inductance_from_gap,
)
from mount_models.specimen import default_specimen
from mount_sim.plant.closing import ClosingMechanics
from mount_sim.plant.reluctance import ReluctanceActuator, force
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

MAGNET, COIL = ReluctanceActuator(), RippleCoil()


@pytest.fixture(scope='module')
def measured():
    return measure_actuator(MAGNET, COIL)


def test_the_default_specimen_knows_the_stiffnesses_of_the_design():
    stored = default_specimen()
    assert (stored.spring_stiffness, stored.pad_stiffness) == ClosingMechanics()[:2]


def test_the_stated_quality_of_the_fit_meets_the_targets():
    parts = default_specimen().provenance['parts']
    assert parts['force_law']['residuals']['relative_rms'] <= 0.005
    assert parts['force_law']['residuals']['relative_worst'] <= 0.01
    for curve in ('inductance_of_gap', 'crossing_current_of_gap'):
        assert max(abs(error) for error in parts['gap_curves'][curve]['gap_errors']) <= 0.1e-6
    assert parts['friction']['residuals']['a_rms'] <= 0.003
    assert parts['friction']['residuals']['b_rms_per_mm'] <= 0.5


def test_the_default_curves_meet_the_published_sections_of_figure_4():
    curves = default_specimen().gap_curves
    gaps = np.array([250, 300, 349, 400, 450, 492, 550]) * 1e-6
    at_rest = 1e3 * inductance_from_gap(curves, gaps)
    assert at_rest == pytest.approx([52.26, 50.06, 48.04, 46.12, 44.40, 43.07, 41.40], abs=0.009)
    crossing = crossing_current_from_gap(curves, gaps)
    assert crossing == pytest.approx([1.1694, 1.2890, 1.3971, 1.5004, 1.5931, 1.6648, 1.7550], abs=0.00011)


def test_the_rig_measures_force_and_inductance_of_the_simulated_actuator(measured):
    row, column = 10, 60
    gap, current = RIG_GAPS[row], RIG_CURRENTS[column]
    assert measured.force.shape == measured.inductance.shape == (RIG_GAPS.size, RIG_CURRENTS.size)
    assert measured.force[row, column] == force(MAGNET, current, gap)
    assert measured.inductance[row, column] == pytest.approx(
        incremental_inductance(COIL, MAGNET, current, gap), rel=1e-12
    )


def test_noise_of_the_rig_is_seeded_and_of_the_stated_size(measured):
    noise = {'force_noise': 0.5, 'ratio_noise': 0.01}
    one, two = (measure_actuator(MAGNET, COIL, **noise, seed=7) for _ in range(2))
    assert (one.force == two.force).all()
    assert np.std(one.force - measured.force) == pytest.approx(0.5, rel=0.05)
    assert np.std(one.inductance / measured.inductance - 1.0) == pytest.approx(0.01, rel=0.05)
    other = measure_actuator(MAGNET, COIL, **noise, seed=8)
    assert not (one.force == other.force).any()
