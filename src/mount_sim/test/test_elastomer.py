"""The elastomer spring: its dynamic stiffness, and steps that follow it and never return energy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stiffness import dynamic_stiffness

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import number_record
from mount_sim.plant.vehicle import BRANCHES, Elastomer, elastomer_force, stretch_branches

ELASTOMER = Elastomer()


def branches(*forces):
    """Return the state of the branches (1,)."""
    return np.array([forces], number_record(*BRANCHES))


@compiled
def response(elastomer, state, displacement, dt):
    force = np.zeros(displacement.size)
    before = displacement[0]
    for k in range(displacement.size):
        stretch_branches(elastomer, state[0], displacement[k] - before, dt)
        force[k] = elastomer_force(elastomer, displacement[k], state[0])
        before = displacement[k]
    return force


@pytest.mark.parametrize('frequency', [8.0, 27.0, 50.0])
def test_steps_follow_the_dynamic_stiffness(frequency):
    dt = 5e-5
    phase = 2.0 * np.pi * frequency * np.arange(0.0, 2.0, dt)
    force = response(ELASTOMER, branches(0.0, 0.0, 0.0), 1e-3 * np.sin(phase), dt)
    whole = slice(-round(1.0 / dt), None)
    found = 2j * np.mean(force[whole] * np.exp(-1j * phase[whole])) / 1e-3
    expected = dynamic_stiffness(ELASTOMER, frequency)
    assert abs(found - expected) < 2e-5 * abs(expected)


@given(velocity=st.floats(-1.0, 1.0), dt=st.floats(1e-6, 0.05), parts=st.integers(2, 7))
@settings(deadline=None, derandomize=True, max_examples=100)
def test_one_step_equals_several_at_the_same_velocity(velocity, dt, parts):
    whole, divided = branches(3.0, -2.0, 1.0), branches(3.0, -2.0, 1.0)
    stretch_branches(ELASTOMER, whole[0], velocity * dt, dt)
    for _ in range(parts):
        stretch_branches(ELASTOMER, divided[0], velocity * dt / parts, dt / parts)
    assert divided.tolist()[0] == pytest.approx(whole.tolist()[0], rel=1e-9, abs=1e-12)
