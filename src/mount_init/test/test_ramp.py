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


def test_the_ramp_rests_rises_to_its_peak_and_goes_the_same_way_back_to_zero(ramp):
    setpoints = ramp.setpoints
    assert (setpoints.size, setpoints.min(), setpoints.max()) == (2750, 0.0, 3.0)
    assert setpoints[0] < 0.001
    assert (setpoints[-30:] == 0.0).all()
    for part in (ramp.dwell_before, ramp.dwell_after):
        assert setpoints[part].tolist() == [0.2] * 250
    up, down = setpoints[ramp.up], setpoints[ramp.down]
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


def test_a_dwell_that_only_settles_is_refused():
    with pytest.raises(InitialisationError, match=r'settle_duration \(0\.3 s\) must lie below'):
        current_ramp(InitParameters(settle_duration=0.3), 0.2)
