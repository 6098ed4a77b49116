"""The current over the sample number."""

import numpy as np
import pytest

from mount_init.parameters import InitParameters
from mount_init.ramp import current_ramp


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
