"""By how much one signal is later than another."""

import math

import numpy as np
import pytest

from engine_mount.recordings.difference import lag

PERIOD = 1e-3


def _noise(count: int, shift: float = 0.0, seed: int = 1) -> np.ndarray:
    """Return band-limited noise, `shift` (s) later."""
    generator = np.random.default_rng(seed)
    time = np.arange(count) * PERIOD - shift
    parts = zip(generator.uniform(1.0, 20.0, 30), generator.uniform(0.0, 6.28, 30), strict=True)
    return sum(np.sin(2 * np.pi * frequency * time + phase) for frequency, phase in parts)


def _sine(shift: float = 0.0) -> np.ndarray:
    return np.sin(50.0 * (np.arange(2000) * PERIOD - shift))


def _gap(signal: np.ndarray, place: int) -> np.ndarray:
    signal[place : place + 20] = np.nan
    return signal


@pytest.mark.parametrize(
    ('a', 'b', 'shift'),
    [
        *((_noise(4000), _noise(4000, shift), shift) for shift in (0.0, 0.3e-3, 12e-3, -7.4e-3, 0.213)),
        (_noise(2000), 1.3 * _noise(2000) + 5.0, 0.0),
        (_sine(), _sine(0.004), 0.004),
        (_gap(_noise(4000), 100), _gap(_noise(4000, 5e-3), 105), 5e-3),
    ],
)
def test_the_shortest_lag_is_found_below_one_sample(a, b, shift):
    assert lag(a, b, PERIOD) == pytest.approx(shift, abs=0.05e-3)


@pytest.mark.parametrize(
    ('a', 'b'),
    [
        (_noise(500), np.full(500, 3.7)),
        (np.full(500, np.nan), _noise(500)),
        (_noise(20), _noise(20)),
        (_noise(4000), _noise(4000, seed=2)),
    ],
)
def test_where_shapes_differ_no_lag_is_told(a, b):
    assert math.isnan(lag(a, b, PERIOD))


def test_a_shift_of_a_small_part_is_no_lag_of_the_whole():
    a = _noise(4000)
    b = a.copy()
    b[2000:2200] = _noise(4000, 8e-3)[2000:2200]
    assert not abs(lag(a, b, PERIOD)) >= 0.1e-3
