"""Even samples at another rate: accurate in the band, nothing beyond it, no overshoot but the stated."""

import math

import numpy as np
import pytest

from engine_mount.signals import resampling
from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.resampling import HALF_LENGTH, has_step, resampled
from engine_mount.signals.signal import SignalError, check_size

STEP = 5e-5


def signal(values, period=0.01):
    return EvenSignal('z', period, np.asarray(values, float), 0)


def of_sine(frequency, period=1.0, step=0.0731):
    """Return times and what a sine becomes there, away from both ends."""
    samples = np.cos(2.0 * np.pi * frequency * period * np.arange(1000) + 0.3)
    times = 200.0 * period + step * np.arange(int(600 * period / step))
    return times, resampled(signal(samples, period), step, times[0], times.size)[:]


@pytest.mark.parametrize(
    ('frequency', 'share'), [(0.01, 1.0), (0.2, 1.0), (0.35, 1.0), (0.4, 1.0), (0.45, 0.5), (0.48, 0.0344)]
)
def test_a_sine_comes_out_as_it_was_in_its_band_and_halved_at_the_corner_without_images(frequency, share):
    times, found = of_sine(frequency)
    wave = share * np.cos(2.0 * np.pi * frequency * times + 0.3)
    assert np.abs(found - wave).max() < 2e-4 + (share < 1.0) * 2e-4


@pytest.mark.parametrize(
    ('frequency', 'share'), [(0.02, 1.0), (0.04, 1.0), (0.045, 0.5), (0.05, 0.0), (0.3, 0.0)]
)
def test_a_slower_rate_takes_only_what_it_can_hold(frequency, share):
    samples = np.cos(2.0 * np.pi * frequency * np.arange(20_000))
    found = resampled(signal(samples, 1.0), 10.0, 3000.0, 1300)[:]
    expected = share * np.cos(2.0 * np.pi * frequency * (3000.0 + 10.0 * np.arange(1300)))
    assert np.abs(found - expected).max() < 3e-4


def test_a_constant_stays_one_up_to_the_ends():
    np.testing.assert_allclose(resampled(signal(np.full(200, 9.81)), STEP)[:], 9.81, rtol=1e-12)


def test_samples_that_have_the_step_are_not_touched():
    values = np.random.default_rng(2).standard_normal(2000)
    for period in (1e-3, 1e-3 * (1.0 + 4e-5)):
        np.testing.assert_array_equal(resampled(signal(values, period), 1e-3)[:], values)
    assert not has_step(signal(values, 1e-3 * (1.0 + 1e-4)), 1e-3)


def test_a_step_overshoots_by_no_more_than_stated():
    found = resampled(signal(np.repeat([0.0, 1.0], 200)), STEP)[:]
    assert found.max() < 1.13
    assert found.min() > -0.13


def test_the_worst_of_all_samples_leaves_their_range_by_no_more_than_stated():
    kernel = resampling._kernel()
    worst = 0.0
    for offset in np.linspace(0.0, 1.0, 41):
        distances = np.abs(np.arange(-HALF_LENGTH, HALF_LENGTH + 1) - offset)
        weights = np.where(
            distances < HALF_LENGTH, kernel[np.minimum((distances * 1024).astype(int), kernel.size - 1)], 0.0
        )
        worst = max(worst, (np.abs(weights).sum() / weights.sum() - 1.0) / 2.0)
    assert 0.5 < worst < 0.6


def test_a_value_beyond_its_limit_is_named():
    values = np.zeros(500)
    values[[321, 400]] = -3000.0, 60.0
    with pytest.raises(SignalError) as caught:
        check_size('z', values, 0.01, 50.0, 'm/s^2', 'cut it')
    assert str(caught.value) == (
        'z: sample 321 at 3.2100 s is -3000 m/s^2, beyond +-50 m/s^2 (2 such of 500); cut it'
    )


def test_the_kernel_is_that_of_its_formula():
    """By NumPy's functions, which the kernel must not call: they differ in the last bit between machines."""
    distance = np.arange(HALF_LENGTH * 1024) / 1024
    window = np.i0(7.857 * np.sqrt(1.0 - (distance / HALF_LENGTH) ** 2)) / np.i0(7.857)
    expected = window * np.sinc(0.9 * distance)
    np.testing.assert_allclose(resampling._kernel()[: distance.size], expected, atol=1e-12)
    assert math.isclose(resampling._kernel()[-1], 0.0)
