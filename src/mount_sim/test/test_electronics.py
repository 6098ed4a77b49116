"""Current loop, ripple measurement and noise of the simulated electronics."""

import itertools
import math

import numpy as np
import pytest

from mount_sim.electronics.electronics import ElectronicsParameters, Noise, advance_current, read_sensors
from mount_sim.plant.reluctance import ReluctanceActuator, mean_incremental_inductance
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

ACTUATOR, COIL = ReluctanceActuator(), RippleCoil()
DT, GAP = 5e-5, 349e-6


def _loop(wanted, current=0.0, **changes):
    """Coil currents after each step of the loop, for an array of wanted currents."""
    electronics = ElectronicsParameters(**changes)
    currents = []
    for target in wanted:
        current = advance_current(electronics, COIL, ACTUATOR, current, GAP, target, DT)
        currents.append(current)
    return np.array(currents)


@pytest.mark.parametrize('bandwidth', [100.0, 400.0, 1000.0])
def test_small_steps_follow_with_the_stated_bandwidth(bandwidth):
    steps = DT * np.arange(1, 41)
    expected = 1.0 + 1e-3 * (1.0 - np.exp(-2.0 * math.pi * bandwidth * steps))
    np.testing.assert_allclose(_loop([1.001] * 40, 1.0, current_bandwidth=bandwidth), expected, rtol=1e-12)


@pytest.mark.parametrize('wanted', [[3.0] * 400, [0.0, 3.0] * 200, [2.0] * 50 + [0.0] * 100 + [3.0] * 200])
def test_the_coil_never_sees_more_than_the_link_voltage(wanted):
    currents = np.r_[0.0, _loop(wanted)]
    for before, after in itertools.pairwise(currents):
        inductance = mean_incremental_inductance(ACTUATOR, before, GAP)
        voltage = COIL.resistance * before + inductance * (after - before) / DT
        assert voltage <= COIL.link_voltage * (1.0 + 1e-9)
        assert voltage >= -COIL.link_voltage * (1.0 + 1e-9) or after == 0.0


def test_the_current_reaches_its_setpoint_and_0_exactly():
    assert _loop([1.5] * 2000)[-1] == pytest.approx(1.5, abs=1e-6)
    assert _loop([0.0] * 1000, 3.0)[-1] == 0.0
    assert (_loop([0.0] * 1000, 3.0) >= 0.0).all()


def _readings(count=20_000, current=0.2, gap=492e-6, seed=1, velocity=0.0, **changes):
    electronics = ElectronicsParameters(**changes)
    noise = Noise(seed)
    return np.array(
        [
            read_sensors(electronics, COIL, ACTUATOR, 1e-3, velocity, current, gap, noise.next())
            for _ in range(count)
        ]
    )


def test_without_noise_the_ripple_shows_the_coil_s_inductance():
    readings = _readings(1, displacement_noise=0.0, ripple_noise=0.0)[0]
    inductance = ACTUATOR.turns * ACTUATOR.gap_area * readings[3] / readings[2]
    assert inductance == pytest.approx(incremental_inductance(COIL, ACTUATOR, 0.2, 492e-6), rel=1e-12)
    assert (readings[0], readings[1]) == (1e-3, 0.2)


def test_jitter_scatters_the_displacement_of_a_moving_mount():
    quiet = {'displacement_noise': 0.0, 'sample_jitter': 3e-4}
    moving, resting = _readings(velocity=0.1, **quiet), _readings(100, **quiet)
    assert np.std(moving[:, 0]) == pytest.approx(0.1 * 3e-4, rel=0.03)
    assert np.mean(moving[:, 0]) == pytest.approx(1e-3, rel=1e-3)
    assert (resting[:, 0] == 1e-3).all()
