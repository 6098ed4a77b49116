"""The hydromount: dynamic stiffness, harmonics, what the asymmetry does, and that it never returns energy."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from stiffness import dynamic_stiffness

from mount_models.arithmetic.compiled import compiled
from mount_sim.plant.hydromount import (
    HYDROMOUNT_STATE,
    Hydromount,
    hydromount_force,
    hydromount_step,
    upper_pressure,
)
from mount_sim.plant.vehicle import Elastomer

HYDROMOUNT = Hydromount()
DT = 5e-5
PERIODS, SETTLED = 30, 5


@compiled
def hydromount_response(hydromount, displacement, dt):
    """Return the fluid's force (N), (n,), for `displacement` (m), (n,), samples `dt` seconds apart.

    The mount is at rest at the first displacement. Add the force of the elastomer.
    """
    force = np.zeros(displacement.size)
    state = np.zeros(1, HYDROMOUNT_STATE)
    for k in range(1, displacement.size):
        hydromount_step(hydromount, state[0], displacement[k] - displacement[k - 1], dt)
        force[k] = hydromount_force(hydromount, state[0])
    return force


def shaken(frequency, amplitude, hydromount=HYDROMOUNT, dt=DT):
    """Complex amplitudes (N) of harmonics 1 to 8 of the mount's force on a sine, elastomer included."""
    count = round(1.0 / frequency / dt)
    phase = 2.0 * np.pi * np.arange(PERIODS * count) / count
    force = hydromount_response(hydromount, amplitude * np.sin(phase), dt)[-SETTLED * count :]
    turns = np.exp(-1j * np.outer(np.arange(1, 9), phase[-SETTLED * count :]))
    harmonics = 2j * turns @ force / force.size
    harmonics[0] += amplitude * dynamic_stiffness(Elastomer(), frequency)
    return harmonics


@pytest.mark.parametrize(('amplitude', 'storage', 'loss'), [(1e-3, 266.0, 81.0), (1e-4, 184.0, 42.0)])
def test_storage_and_loss_at_8_hz_have_their_values_in_newton_per_millimetre(amplitude, storage, loss):
    stiffness = shaken(8.0, amplitude)[0] / amplitude / 1e3
    assert stiffness.real == pytest.approx(storage, abs=0.5)
    assert stiffness.imag == pytest.approx(loss, abs=0.5)


def test_harmonics_at_8_hz_and_1_mm_have_their_values():
    expected = [277.8, 5.03, 13.23, 2.01, 5.36, 1.02, 2.32, 0.50]
    found = np.abs(shaken(8.0, 1e-3))
    np.testing.assert_allclose(found, expected, rtol=0.005, atol=0.02)
    assert np.linalg.norm(found[1:]) / found[0] == pytest.approx(0.056, abs=0.0005)


@given(
    volume=st.floats(-3e-5, 3e-5),
    asymmetry=st.sampled_from([0.0, 0.25, 0.9]),
)
@example(volume=6e-11 * 6e4 * 0.875, asymmetry=0.25)
@example(volume=-6e-11 * 6e4 * 1.125, asymmetry=0.25)
@settings(deadline=None, derandomize=True, max_examples=200)
def test_the_slope_of_the_bulge_is_its_compliance(volume, asymmetry):
    hydromount = HYDROMOUNT._replace(compliance_asymmetry=asymmetry)
    width = 1e-9
    low, high = (upper_pressure(hydromount, volume + side) for side in (-width, width))
    pressure = upper_pressure(hydromount, volume)
    compliance = 6e-11 * (1.0 - asymmetry * np.clip(pressure / 6e4, -1.0, 1.0))
    assert 2.0 * width / (high - low) == pytest.approx(compliance, rel=2e-3)


@given(
    frequency=st.floats(0.5, 60.0),
    amplitude=st.floats(1e-5, 5e-3),
    second=st.floats(0.0, 1.0),
    asymmetry=st.sampled_from([0.0, 0.25]),
    resistance=st.sampled_from([2e7, 1e8, 2e8]),
)
@settings(deadline=None, derandomize=True, max_examples=60)
def test_it_never_returns_more_energy_than_it_was_given(frequency, amplitude, second, asymmetry, resistance):
    hydromount = HYDROMOUNT._replace(compliance_asymmetry=asymmetry, decoupler_resistance=resistance)
    phase = 2.0 * np.pi * frequency * np.arange(0.0, 1.0, DT)
    stroke = amplitude * (np.sin(phase) + second * np.sin(2.7 * phase))
    force = hydromount_response(hydromount, stroke, DT)
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke))
    assert work.min() >= -1e-4 * np.abs(work).max()
