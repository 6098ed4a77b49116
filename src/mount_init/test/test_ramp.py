"""The current over the sample number."""

import numpy as np
import pytest

from mount_init.errors import InitialisationError
from mount_init.parameters import InitParameters
from mount_init.ramp import current_ramp
from mount_models.quantity import with_values

STEEPEST = 140.0  # A/s that 14 V allow in a coil of 100 mH


@pytest.fixture
def ramp():
    return current_ramp(InitParameters(), 0.2)


def test_ramp_takes_between_two_and_three_seconds(ramp):
    assert 2000 <= ramp.setpoints.size <= 3000
    assert ramp.setpoints.size == 2750


def test_ramp_starts_near_and_ends_at_zero(ramp):
    assert 0.0 <= ramp.setpoints[0] < 0.001
    assert (ramp.setpoints[-30:] == 0.0).all()


def test_ramp_stays_within_zero_and_its_peak(ramp):
    assert ramp.setpoints.min() == 0.0
    assert ramp.setpoints.max() == 3.0


def test_dwells_hold_the_rest_current_exactly(ramp):
    for part in (ramp.dwell_before, ramp.dwell_after):
        assert (ramp.setpoints[part] == 0.2).all()
        assert ramp.setpoints[part].size == 250


def test_ramp_goes_up_and_the_same_way_down(ramp):
    up, down = ramp.setpoints[ramp.up], ramp.setpoints[ramp.down]
    assert (np.diff(up) > 0.0).all()
    assert np.array_equal(up, down[::-1])


def test_ramp_is_smooth(ramp):
    slope = np.diff(np.concatenate([[0.0], ramp.setpoints])) * 1000.0
    assert np.abs(slope).max() < 7.0
    assert np.abs(np.diff(slope)).max() < 1.0


def test_even_the_quickest_ramp_leaves_the_voltage_room():
    quick = with_values(InitParameters(), rise_duration=0.02, ramp_duration=0.2)
    slope = np.diff(current_ramp(quick, 0.2).setpoints) * 1000.0
    assert np.abs(slope).max() < 0.3 * STEEPEST


def test_same_parameters_give_the_same_ramp_to_the_bit(ramp):
    assert np.array_equal(ramp.setpoints, current_ramp(InitParameters(), 0.2).setpoints)


def test_a_rest_current_beyond_the_peak_is_refused():
    with pytest.raises(InitialisationError, match=r'3\.500 A.*\(3\.000 A\); check the specimen'):
        current_ramp(InitParameters(), 3.5)


def test_a_dwell_that_only_settles_is_refused():
    with pytest.raises(InitialisationError, match=r'settle_duration \(0\.3 s\) must lie below'):
        current_ramp(InitParameters(settle_duration=0.3), 0.2)
