"""The elastomer spring: its dynamic stiffness, and steps that follow it and never return energy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stiffness import dynamic_stiffness

from mount_models.arithmetic.compiled import compiled
from mount_models.quantity import checked, quantities
from mount_sim.plant.vehicle import Elastomer, branch_step, elastomer_force

ELASTOMER = Elastomer()


@compiled
def response(elastomer, displacement, dt):
    force = np.zeros(displacement.size)
    branch_forces = (0.0, 0.0, 0.0)
    before = displacement[0]
    for k in range(displacement.size):
        branch_forces = branch_step(elastomer, branch_forces, displacement[k] - before, dt)
        force[k] = elastomer_force(elastomer, displacement[k], branch_forces)
        before = displacement[k]
    return force


@pytest.mark.parametrize(
    ('frequency', 'storage', 'loss'), [(8, 181.7, 14.1), (27, 193.6, 13.1), (50, 199.4, 11.7)]
)
def test_dynamic_stiffness_has_its_values_in_newton_per_millimetre(frequency, storage, loss):
    stiffness = dynamic_stiffness(ELASTOMER, frequency) / 1000.0
    assert stiffness.real == pytest.approx(storage, abs=0.06)
    assert stiffness.imag == pytest.approx(loss, abs=0.06)
    assert 0.058 < stiffness.imag / stiffness.real < 0.08


@pytest.mark.parametrize('frequency', [8.0, 27.0, 50.0])
def test_steps_follow_the_dynamic_stiffness(frequency):
    dt = 5e-5
    phase = 2.0 * np.pi * frequency * np.arange(0.0, 2.0, dt)
    force = response(ELASTOMER, 1e-3 * np.sin(phase), dt)
    whole = slice(-round(1.0 / dt), None)
    found = 2j * np.mean(force[whole] * np.exp(-1j * phase[whole])) / 1e-3
    expected = dynamic_stiffness(ELASTOMER, frequency)
    assert abs(found - expected) < 2e-5 * abs(expected)


def test_stiffness_rises_from_the_static_to_the_sum_of_all_springs():
    static, slow, fast = dynamic_stiffness(ELASTOMER, [0.0, 1.0, 1e6])
    assert static == 1.6e5
    assert static.real < slow.real < fast.real == pytest.approx(2.08e5, rel=1e-6)


@given(velocity=st.floats(-1.0, 1.0), dt=st.floats(1e-6, 0.05), parts=st.integers(2, 7))
@settings(deadline=None, derandomize=True, max_examples=100)
def test_one_step_equals_several_at_the_same_velocity(velocity, dt, parts):
    whole = branch_step(ELASTOMER, (3.0, -2.0, 1.0), velocity * dt, dt)
    forces = (3.0, -2.0, 1.0)
    for _ in range(parts):
        forces = branch_step(ELASTOMER, forces, velocity * dt / parts, dt / parts)
    assert forces == pytest.approx(whole, rel=1e-9, abs=1e-12)


@given(changes=st.lists(st.floats(-1e-3, 1e-3), min_size=1, max_size=20), dt=st.floats(1e-5, 0.02))
@settings(deadline=None, derandomize=True, max_examples=60)
def test_stretching_and_returning_never_yields_energy(changes, dt):
    work, exchanged, forces = closed_path(ELASTOMER, np.array([*changes, -sum(changes)]), dt)
    stored = sum(0.5 * force**2 / ELASTOMER.slow_stiffness for force in forces)
    assert work >= stored - 1e-3 * exchanged


@compiled
def closed_path(elastomer, changes, dt):
    """Return the work, the sum of its magnitudes and the last branch forces, by 50 trapezoids per change."""
    work = exchanged = displacement = 0.0
    forces = (0.0, 0.0, 0.0)
    for change in changes:
        for _ in range(50):
            start = elastomer_force(elastomer, displacement, forces)
            forces = branch_step(elastomer, forces, change / 50.0, dt / 50.0)
            displacement += change / 50.0
            part = 0.5 * (start + elastomer_force(elastomer, displacement, forces)) * change / 50.0
            work += part
            exchanged += abs(part)
    return work, exchanged, forces


def test_forces_decay_when_the_mount_is_held():
    slow, middle, fast = branch_step(ELASTOMER, (10.0, 10.0, 10.0), 0.0, 0.1)
    assert slow == pytest.approx(10.0 * np.exp(-2.0 * np.pi * 0.2), rel=1e-12)
    assert 0.0 < fast < middle < slow


def test_every_parameter_has_unit_meaning_and_a_range_that_holds_its_default():
    assert set(quantities(ELASTOMER)) == set(ELASTOMER._fields)
    assert checked(ELASTOMER) == ELASTOMER
