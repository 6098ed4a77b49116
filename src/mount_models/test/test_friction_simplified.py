"""The simplified friction model, Eq (9), and the normal force that gives a desired force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.friction.coefficient import FrictionCoefficients, dynamic_coefficient
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import (
    LOWEST_COEFFICIENT,
    fade_weight,
    normal_force_for,
    simplified_response,
    simplified_step,
    speed_terms,
)

COEFS = FrictionCoefficients()
CONTACT = FrictionContact()


def _faded(coefs, velocity, deflection_u, normal_force):
    return fade_weight(velocity) * dynamic_coefficient(coefs, velocity, deflection_u, normal_force)


@pytest.mark.parametrize('dt', [1e-5, 1e-4, 1e-3])
def test_sine_at_8_hertz_gives_the_known_peaks_and_work(dt):
    time = np.arange(0.0, 6.0, dt)
    phase = 2.0 * np.pi * 8.0 * time
    force, _ = simplified_response(
        CONTACT, COEFS, 1e-3 * 2.0 * np.pi * 8.0 * np.cos(phase), np.full(time.size, 100.0), dt
    )
    cycle = force[-round(0.125 / dt) :]
    assert cycle.max() == pytest.approx(132.29, abs=0.02)
    # a coarse step samples beside the peak
    assert cycle.min() == pytest.approx(-203.12, abs=0.02 if dt < 1e-3 else 0.1)
    velocity = 1e-3 * 2.0 * np.pi * 8.0 * np.cos(phase[-cycle.size :])
    assert np.sum(cycle * velocity) * dt == pytest.approx(0.640, abs=6e-4)


velocities = st.floats(-2.0, 2.0)
loads = st.floats(0.0, 350.0)


@given(velocity=velocities, normal_force=loads, start=st.floats(-20e-6, 20e-6))
@settings(deadline=None, derandomize=True, max_examples=100)
def test_two_half_steps_equal_one_step(velocity, normal_force, start):
    _, whole, _ = simplified_step(CONTACT, COEFS, start, velocity, normal_force, 0.2)
    _, half, _ = simplified_step(CONTACT, COEFS, start, velocity, normal_force, 0.1)
    _, halves, _ = simplified_step(CONTACT, COEFS, half, velocity, normal_force, 0.1)
    assert halves == pytest.approx(whole, rel=1e-9, abs=1e-18)


@given(velocity=velocities, normal_force=loads, deflection=st.floats(-100e-6, 100e-6))
@settings(deadline=None, derandomize=True, max_examples=200)
def test_force_only_opposes_motion(velocity, normal_force, deflection):
    force, _, coefficient = simplified_step(CONTACT, COEFS, deflection, velocity, normal_force, 1e-3)
    assert force * velocity >= 0.0
    assert abs(force) == pytest.approx(coefficient * normal_force, rel=1e-12)


def test_deflection_settles_where_the_spring_carries_the_friction_force():
    force, deflection, _ = simplified_step(CONTACT, COEFS, 0.0, 0.005, 100.0, 100.0)
    assert force == pytest.approx(76.3, abs=0.05)
    assert deflection == pytest.approx(force / CONTACT.tangential_stiffness, rel=1e-9)


def test_force_fades_to_zero_at_rest_and_is_whole_at_sliding_speed():
    assert simplified_step(CONTACT, COEFS, 0.0, 0.0, 100.0, 1e-3)[0] == 0.0
    assert _faded(COEFS, 0.001, 0.0, 100.0) == pytest.approx(
        (1.0 - np.exp(-1.0)) * dynamic_coefficient(COEFS, 0.001, 0.0, 100.0), rel=1e-12
    )
    assert _faded(COEFS, 0.005, 0.0, 100.0) == pytest.approx(
        dynamic_coefficient(COEFS, 0.005, 0.0, 100.0), rel=1e-9
    )


def needed(force, velocity, deflection_u, start):
    """Return the normal force (N) for a force (N), and its coefficient."""
    return normal_force_for(speed_terms(COEFS, velocity), COEFS, force, velocity, deflection_u, start)


@given(
    velocity=st.floats(0.004, 0.5),
    sign=st.sampled_from([-1.0, 1.0]),
    force=st.floats(1.0, 250.0),
    deflection_u=st.floats(-10e-6, 10e-6),
    start=st.floats(0.0, 300.0),
)
@settings(deadline=None, derandomize=True, max_examples=200)
def test_normal_force_gives_the_desired_force(velocity, sign, force, deflection_u, start):
    normal_force, coefficient = needed(force, sign * velocity, deflection_u, start)
    assert coefficient * normal_force == pytest.approx(force, rel=1e-12)
    mu = _faded(COEFS, sign * velocity, deflection_u, normal_force)
    assert mu * normal_force == pytest.approx(force, rel=1e-3)


def test_normal_force_for_a_signed_force_is_that_for_its_magnitude():
    assert needed(-80.0, -0.02, 0.0, 50.0) == needed(80.0, -0.02, 0.0, 50.0)


def test_coefficient_counts_at_least_its_floor_where_it_fades():
    normal_force, coefficient = needed(3.0, 0.0, 0.0, 0.0)
    assert coefficient == LOWEST_COEFFICIENT
    assert normal_force == pytest.approx(60.0)


def test_no_desired_force_needs_no_normal_force():
    assert needed(0.0, 0.03, 0.0, 80.0)[0] == 0.0
