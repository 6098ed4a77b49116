"""The lag between two signals: exact below one sample, and silent where nothing can be told."""

import math

import numpy as np
import pytest

from engine_mount.recordings.compare.lag import lag

PERIOD = 1e-3


def _noise(count: int, shift: float = 0.0, seed: int = 1) -> np.ndarray:
    """Return band-limited noise, `shift` (s) later."""
    generator = np.random.default_rng(seed)
    time = np.arange(count) * PERIOD - shift
    parts = zip(generator.uniform(1.0, 20.0, 30), generator.uniform(0.0, 6.28, 30), strict=True)
    return sum(np.sin(2 * np.pi * frequency * time + phase) for frequency, phase in parts)


@pytest.mark.parametrize('shift', [0.0, 0.3e-3, 1e-3, 12e-3, -7.4e-3, 0.213])
def test_the_lag_of_noise_is_found_below_one_sample(shift):
    found = lag(_noise(4000), _noise(4000, shift), PERIOD)
    assert found.seconds == pytest.approx(shift, abs=0.02e-3)
    assert found.remark == ''


def test_another_amplitude_is_no_lag():
    assert lag(_noise(2000), 1.3 * _noise(2000) + 5.0, PERIOD).seconds == pytest.approx(0.0, abs=1e-6)


def test_the_lag_of_a_sine_is_told_up_to_whole_periods():
    time = np.arange(2000) * PERIOD
    found = lag(np.sin(50.0 * time), np.sin(50.0 * (time - 0.004)), PERIOD)
    assert found.seconds == pytest.approx(0.004, abs=0.05e-3)
    assert found.remark == 'or whole periods of 126 ms more'


@pytest.mark.parametrize(
    ('a', 'b', 'why'),
    [
        (np.full(500, 0.1), np.full(500, 0.1), 'constant in A and B: no lag can be told'),
        (_noise(500), np.full(500, 3.7), 'constant in B: no lag can be told'),
        (np.full(500, np.nan), _noise(500), 'constant in A: no lag can be told'),
        (_noise(20), _noise(20), '20 samples are too few for a lag'),
        (_noise(4000), _noise(4000, seed=2), 'shapes differ too much'),
    ],
)
def test_where_no_lag_can_be_told_the_reason_is(a, b, why):
    found = lag(a, b, PERIOD)
    assert math.isnan(found.seconds)
    assert why in found.remark


def test_a_shift_of_a_small_part_is_no_lag_of_the_whole():
    a = _noise(4000)
    b = a.copy()
    b[2000:2200] = _noise(4000, 8e-3)[2000:2200]
    found = lag(a, b, PERIOD)
    assert not found.known or abs(found.seconds) < 0.1e-3


def test_unknown_samples_do_not_hinder():
    a, b = _noise(4000), _noise(4000, 5e-3)
    a[100:120] = np.nan
    b[105:125] = np.nan
    assert lag(a, b, PERIOD).seconds == pytest.approx(5e-3, abs=0.05e-3)
