"""The latency histogram against exact quantiles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mount_ros.timing import LatencyHistogram

BIN = 10 ** (1 / 50)  # width of a bin, as a ratio


def histogram_of(durations):
    histogram = LatencyHistogram()
    for seconds in durations:
        histogram.add(seconds)
    return histogram


@given(
    durations=st.lists(st.floats(1e-6, 9.9), min_size=1, max_size=60),
    share=st.sampled_from([0.01, 0.5, 0.9, 0.99, 1.0]),
)
def test_quantiles_are_exact_to_one_bin(durations, share):
    exact = np.sort(durations)[max(0, math.ceil(share * len(durations) - 1e-9) - 1)]
    histogram = histogram_of(durations)
    assert histogram.quantile(share) == pytest.approx(exact, rel=BIN - 1)
    assert (histogram.count, histogram.highest) == (len(durations), max(durations))
    assert math.isnan(LatencyHistogram().quantile(share))
