"""Spline and change of rate against those of SciPy, and what they must do by themselves."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly

from mount_sim.resampling import change_rate, spline


@pytest.mark.parametrize('count', [4, 10, 11, 500])
def test_the_spline_is_that_of_scipy(count):
    random = np.random.default_rng(count)
    times, values = np.cumsum(random.uniform(0.5, 1.5, count)), random.normal(size=count)
    at = np.linspace(times[0] - 0.5, times[-1] + 0.5, 777)
    assert spline(times, values, at) == pytest.approx(CubicSpline(times, values)(at), abs=1e-12)
    assert spline(times, values, times) == pytest.approx(values, abs=1e-14)


def test_a_cubic_is_kept_by_the_spline():
    times = np.array([0.0, 0.3, 1.0, 1.1, 2.5])
    at = np.linspace(0.0, 2.5, 40)
    found = spline(times, 1.0 + times - times**3, at)
    assert found == pytest.approx(1.0 + at - at**3, abs=1e-13)


@pytest.mark.parametrize(('up', 'down'), [(10, 1), (5, 4), (3, 7), (1, 2), (40, 22), (997, 1000)])
@pytest.mark.parametrize('count', [10, 333])
def test_the_change_of_rate_is_that_of_scipy(up, down, count):
    values = np.random.default_rng(up).normal(size=count)
    assert change_rate(values, up, down) == pytest.approx(resample_poly(values, up, down), abs=1e-12)


def test_the_same_rate_leaves_the_values_alone():
    values = np.random.default_rng(1).normal(size=50)
    assert np.array_equal(change_rate(values, 3, 3), values)
