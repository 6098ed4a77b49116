"""The full friction model, Eqs (7), (8): known figures, energy, and agreement with the simplified model."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import with_values
from mount_sim.plant.friction import full_response, full_step

COEFS = FrictionCoefficients()
CONTACT = FrictionContact()
CYCLE = 0.125


def sine_response(dt, contact=CONTACT, coefs=COEFS):
    """Return displacement, velocity, force, sliding velocity, deflection of the last cycle of 8 Hz, 1 mm."""
    time = np.arange(0.0, 48 * CYCLE + dt / 2, dt)
    omega = 2.0 * np.pi / CYCLE
    displacement = 1e-3 * np.sin(omega * time)
    force, sliding, deflection = full_response(contact, coefs, displacement, np.full(time.size, 100.0), dt)
    last = slice(-round(CYCLE / dt) - 1, None)
    velocity = 1e-3 * omega * np.cos(omega * time[last])
    return displacement[last], velocity, force[last], sliding[last], deflection[last]


@pytest.mark.parametrize('dt', [1e-5, 1e-4, 1e-3])
def test_sine_at_8_hertz_gives_the_known_peaks_at_every_step_length(dt):
    displacement, _, force, _, _ = sine_response(dt)
    assert force.max() == pytest.approx(132.46, abs=0.1)
    assert force.min() == pytest.approx(-203.31, abs=0.1)
    loss = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement))
    assert loss == pytest.approx(0.629, abs=6e-4 if dt < 1e-3 else 2e-3)


def test_open_pads_carry_no_force_and_the_slider_follows():
    force, slider, deflection, velocity = full_step(CONTACT, COEFS, 0.0, 3e-6, 2e-3, 0.0, 1e-4)
    assert force == 0.0
    assert slider + deflection == pytest.approx(2e-3, abs=1e-15)
    assert velocity == pytest.approx(slider / 1e-4, rel=1e-12)


def test_unknown_input_gives_unknown_force():
    assert math.isnan(full_step(CONTACT, COEFS, 0.0, 0.0, math.nan, 50.0, 1e-4)[0])
    assert math.isnan(full_step(CONTACT, COEFS, 0.0, 0.0, 1e-4, math.nan, 1e-4)[0])


steps = st.lists(
    st.tuples(st.floats(-3e-3, 3e-3), st.one_of(st.just(0.0), st.floats(0.0, 350.0))), min_size=2, max_size=40
)
contacts = st.builds(
    FrictionContact,
    tangential_stiffness=st.floats(1e6, 1e8),
    tangential_damping=st.floats(1e4, 1e7),
    contact_stiffness=st.floats(1e5, 1e8),
)


@given(
    steps=steps, contact=contacts, b_offset=st.sampled_from([14.0, -14.0]), dt=st.sampled_from([1e-5, 1e-3])
)
@settings(deadline=None, derandomize=True, max_examples=150)
def test_energy_is_never_returned_beyond_what_the_springs_hold(steps, contact, b_offset, dt):
    coefs = with_values(COEFS, b_offset=b_offset)
    slider = xi = old_x = stored = 0.0
    for x, normal_force in steps:
        force, slider, xi, velocity = full_step(contact, coefs, slider, xi, x, normal_force, dt)
        assert force * velocity >= 0.0
        assert normal_force > 0.0 or force == 0.0
        still_stored = 0.5 * force**2 / contact.contact_stiffness + 0.5 * contact.tangential_stiffness * xi**2
        work = force * (x - old_x)
        assert still_stored <= stored + work + 1e-9 * (stored + abs(work)) + 1e-15
        assert math.isfinite(slider)
        stored, old_x = still_stored, x
