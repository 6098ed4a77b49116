"""The band-pass at the eigenfrequency and its prediction over the loop's delay."""

import math

import numpy as np
import pytest
from controllers import sine
from scipy import signal

from mount_control import band_pass
from mount_control.policy.switched_viscous import Parameters
from mount_models.sampling import SAMPLE_TIME


def _response(filtered, frequency):
    b, a = [filtered.gain, 0.0, -filtered.gain], [1.0, filtered.a1, filtered.a2]
    return complex(signal.freqz(b, a, [frequency], fs=1.0 / SAMPLE_TIME)[1][0])


def _steady(filtered, displacement):
    """Outputs (n, 3) of n steps from a settled state."""
    state = np.zeros(1, band_pass.STATE)
    band_pass.settle(filtered, state[0], displacement[0])
    return np.array([band_pass.step(filtered, state[0], x) for x in displacement])


@pytest.mark.parametrize('frequency', [2.0, 5.3, 8.0, 12.0, 20.0])
@pytest.mark.parametrize('quality', [0.5, 1.0, 3.0])
def test_gain_is_1_and_phase_0_at_the_eigenfrequency(frequency, quality):
    response = _response(band_pass.design(frequency, quality, 0.0019, SAMPLE_TIME), frequency)
    assert response == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize('frequency', [2.0, 8.0, 20.0])
@pytest.mark.parametrize('quality', [0.5, 3.0])
def test_the_coefficients_are_those_of_the_prewarped_bilinear_transform(frequency, quality):
    w0 = 2.0 * math.pi * frequency
    rate = w0 / (2.0 * math.tan(0.5 * w0 * SAMPLE_TIME))
    b, a = signal.bilinear([w0 / quality, 0.0], [1.0, w0 / quality, w0 * w0], fs=rate)
    filtered = band_pass.design(frequency, quality, 0.0019, SAMPLE_TIME)
    assert (filtered.gain, filtered.a1, filtered.a2) == pytest.approx((b[0], a[1], a[2]), rel=1e-12)


@pytest.mark.parametrize('displacement', [0.0, 0.004, -0.011])
def test_a_settled_band_pass_gives_no_transient(displacement):
    outputs = _steady(band_pass.design(8.0, 1.0, 0.0019, SAMPLE_TIME), np.full(500, displacement))
    assert np.abs(outputs[:, 0]).max() < 1e-15
    assert np.abs(outputs[:, 2]).max() < 1e-12


@pytest.mark.parametrize('lead_time', [0.0, 0.0005, Parameters().lead_time, 0.005, 0.015])
@pytest.mark.parametrize('frequency', [4.0, 8.0])
def test_predicted_velocity_is_the_true_one_a_lead_time_later(lead_time, frequency):
    filtered = band_pass.design(frequency, 1.0, lead_time, SAMPLE_TIME)
    predicted = _steady(filtered, sine(frequency, 1e-3, 4.0))[-500:, 2]
    w0, times = 2.0 * math.pi * frequency, 1e-3 * np.arange(3500, 4000)
    true = 1e-3 * w0 * np.cos(w0 * (times + lead_time))
    assert np.abs(predicted - true).max() < 1e-3 * np.abs(true).max()


def test_a_whole_signal_is_filtered_as_by_scipy():
    band = band_pass.design(8.0, 1.0, 0.0, SAMPLE_TIME)
    values = np.random.default_rng(1).normal(size=500)
    expected = signal.lfilter([band.gain, 0.0, -band.gain], [1.0, band.a1, band.a2], values)
    np.testing.assert_allclose(_steady(band, np.r_[0.0, values])[1:, 0], expected, rtol=0.0, atol=1e-14)
