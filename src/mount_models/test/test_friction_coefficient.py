"""Eqs (12)-(14) against the values that Table 2 gives, and the inverse in velocity against the law."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import (
    FrictionCoefficients,
    dynamic_coefficient,
    offset_coefficient,
    sliding_speed,
    slope_coefficient,
)
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import with_values

TABLE_2 = FrictionCoefficients()
CONTACT = FrictionContact()


def steady_coefficient(velocity, normal_force, coefs=TABLE_2):
    """mu after xi has settled at mu F_N / c_R: a / (1 - b F_N / c_R)."""
    a = offset_coefficient(coefs, velocity, normal_force)
    b = slope_coefficient(coefs, velocity, normal_force)
    return a / (1.0 - b * normal_force / CONTACT.tangential_stiffness)


STEADY = {
    40: ['0.455/0.759', '0.651/1.105', '0.729/1.258', '0.818/1.434', '0.961/1.718'],
    80: ['0.533/0.847', '0.740/1.198', '0.801/1.317', '0.900/1.501', '1.057/1.799'],
    100: ['0.560/0.872', '0.763/1.211', '0.809/1.304', '0.909/1.487', '1.067/1.781'],
    120: ['0.577/0.885', '0.772/1.205', '0.801/1.271', '0.900/1.449', '1.057/1.735'],
}


@pytest.mark.parametrize('normal_force', STEADY)
def test_steady_coefficient_has_the_published_consequences_of_table_2(normal_force):
    for speed_mm, pair in zip((1, 5, 10, 20, 60), STEADY[normal_force], strict=True):
        positive, negative = (float(text) for text in pair.split('/'))
        speed = speed_mm * 1e-3
        assert steady_coefficient(speed, float(normal_force)) == pytest.approx(positive, abs=5.1e-4)
        assert steady_coefficient(-speed, float(normal_force)) == pytest.approx(negative, abs=5.1e-4)


def test_law_is_not_extrapolated_beyond_the_identified_loads_and_the_velocity_limit():
    assert offset_coefficient(TABLE_2, 0.01, 20.0) == offset_coefficient(TABLE_2, 0.01, 40.0)
    assert offset_coefficient(TABLE_2, 0.01, 300.0) == offset_coefficient(TABLE_2, 0.01, 120.0)
    assert slope_coefficient(TABLE_2, 0.06, 300.0) == slope_coefficient(TABLE_2, 0.01, 120.0)


def test_scale_multiplies_the_coefficient():
    stronger = with_values(TABLE_2, scale=1.15)
    assert dynamic_coefficient(stronger, 0.02, 3e-6, 80.0) == pytest.approx(
        1.15 * dynamic_coefficient(TABLE_2, 0.02, 3e-6, 80.0), rel=1e-14
    )


loads = st.floats(0.01, 350.0)
directions = st.sampled_from([-1.0, 1.0])


@compiled
def running_maximum(direction, speed, u, normal_force):
    highest = dynamic_coefficient(TABLE_2, direction * 1e-15, u, normal_force)
    for step in range(3001):
        slower = min(speed, 0.010) * 10.0 ** (-step / 500.0)
        highest = max(highest, dynamic_coefficient(TABLE_2, direction * slower, u, normal_force))
    return max(highest, dynamic_coefficient(TABLE_2, direction * speed, u, normal_force))


@given(
    direction=directions,
    ratio=st.floats(0.001, 3.0),
    u=st.floats(-100e-6, 100e-6),
    normal_force=loads,
    resistance=st.floats(1.0, 4000.0),
)
@example(direction=1.0, ratio=0.55, u=30e-6, normal_force=100.0, resistance=40.0)  # on the envelope
@example(direction=1.0, ratio=0.1, u=100e-6, normal_force=100.0, resistance=400.0)  # mu = 0 at rest
@example(direction=-1.0, ratio=0.1, u=1e-3, normal_force=100.0, resistance=400.0)  # mu = 0 far up
@settings(deadline=None, derandomize=True, max_examples=300)
def test_speed_balances_traction_on_the_monotone_envelope(direction, ratio, u, normal_force, resistance):
    traction = ratio * normal_force
    speed = sliding_speed(TABLE_2, direction, traction, u, normal_force, resistance)
    assert 0.0 <= speed <= traction / resistance * (1.0 + 1e-12)
    friction = normal_force * running_maximum(direction, speed, u, normal_force)
    if speed > 0.0:
        assert friction + resistance * speed == pytest.approx(traction, rel=1e-4, abs=1e-9)
    else:
        assert friction >= traction * (1.0 - 1e-12)


def test_contact_sticks_between_the_two_breakaway_forces():
    for direction in (1.0, -1.0):
        limit = 100.0 * dynamic_coefficient(TABLE_2, direction * 1e-15, 0.0, 100.0)
        assert sliding_speed(TABLE_2, direction, 0.999 * limit, 0.0, 100.0, 400.0) == 0.0
        assert sliding_speed(TABLE_2, direction, 1.001 * limit, 0.0, 100.0, 400.0) > 0.0
