"""The simulated rack of the friction contact."""

import numpy as np
import pytest

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_sim.rack import move, sawtooth_corners

CONTACT, COEFFICIENTS = FrictionContact(), FrictionCoefficients()


def test_the_saw_tooth_grows_faster_after_every_second_turning_point():
    times, positions = sawtooth_corners(-2.5e-3, (1e-3, 2e-3, 3e-3))
    speeds = np.array([1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 3e-3, 3e-3])
    assert np.abs(np.diff(positions)) == pytest.approx(speeds * np.diff(times))
    assert positions[1:] == pytest.approx([-2.5e-3, 2.5e-3] * 3 + [-2.5e-3])
    assert (times[0], positions[0]) == (0.0, 0.0)


def test_a_motor_that_gives_way_leaves_its_share_of_the_way():
    stiff = move(CONTACT, COEFFICIENTS, [0.0, 0.01, 0.1], [0.0, 1e-6, 1e-6], 100.0)
    soft = move(CONTACT, COEFFICIENTS, [0.0, 0.01, 0.1], [0.0, 1e-6, 1e-6], 100.0, machine_stiffness=2e6)
    assert stiff.displacement[-1] == pytest.approx(1e-6, rel=1e-12)
    assert soft.friction_force[-1] == pytest.approx(2e6 * (1e-6 - soft.displacement[-1]), rel=1e-9)
    assert soft.friction_force[-1] < 0.6 * stiff.friction_force[-1]
