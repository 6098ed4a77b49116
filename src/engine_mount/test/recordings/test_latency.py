"""Quantiles of latencies without holding them: the same numbers to the bit as with all of them at hand."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from engine_mount.recordings.answers import on_one_clock, setpoint_latency

SOON = st.lists(st.integers(-3_000, 30_000_000), min_size=2, max_size=60)


def both(ages):
    stamps = 10**18 + 1_000_000 * np.arange(len(ages))
    return stamps, stamps + np.array(ages)


def test_latencies_are_those_of_all_ages_at_once():
    @settings(deadline=None, derandomize=True)
    @given(SOON)
    def check(ages):
        found, seconds = setpoint_latency(*both(ages)), np.array(ages) * 1e-9
        assert found.median == np.median(seconds)
        assert found.p99 == np.quantile(seconds, 0.99)
        assert found.worst == seconds.max()

    check()


def test_damaged_times_that_are_farther_apart_than_any_clock_goes_are_of_another_clock():
    stamps, times = np.array([-(2**62), 0, 2**62]), np.array([2**61, 0, -(2**61)])
    assert not on_one_clock(stamps, times)
