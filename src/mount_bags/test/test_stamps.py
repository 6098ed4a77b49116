"""Missing, repeated and late samples, in one go and one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_bags.stamps import StampWatch, stamp_statistics

RATE = 1000.0
PERIOD = 1_000_000


def stamps_of(indices):
    return np.array([1_700_000_000_000_000_000 + index * PERIOD for index in indices], np.int64)


def counts(indices):
    found = stamp_statistics(stamps_of(indices), RATE)
    return found.expected, found.present, found.lost, found.duplicated, found.out_of_order


@pytest.mark.parametrize(
    ('indices', 'expected'),
    [
        ([], (0, 0, 0, 0, 0)),
        ([5], (1, 1, 0, 0, 0)),
        (range(100), (100, 100, 0, 0, 0)),
        ([0, 1, 4, 5], (6, 4, 2, 0, 0)),
        ([0, 1, 1, 2], (3, 4, 0, 1, 0)),
        ([0, 2, 1, 3], (4, 4, 0, 0, 1)),
    ],
)
def test_counts(indices, expected):
    assert counts(indices) == expected


def test_longest_gap_is_told_in_seconds():
    assert stamp_statistics(stamps_of([0, 1, 5, 6]), RATE).longest_gap == pytest.approx(4e-3)
    assert np.isnan(stamp_statistics(stamps_of([0]), RATE).longest_gap)


def test_clock_that_runs_100_ppm_fast_is_no_loss():
    stamps = np.rint(np.arange(60_000) * PERIOD * 1.0001).astype(np.int64)
    found = stamp_statistics(stamps, RATE)
    assert (found.lost, found.duplicated, found.expected) == (0, 0, 60_000)


def test_jitter_below_a_third_of_the_period_is_no_loss():
    jitter = np.random.default_rng(7).uniform(-0.2, 0.2, 5000)
    stamps = np.rint((np.arange(5000) + jitter) * PERIOD).astype(np.int64)
    found = stamp_statistics(stamps, RATE)
    assert (found.lost, found.duplicated, found.out_of_order) == (0, 0, 0)


@settings(deadline=None, derandomize=True)
@given(st.lists(st.integers(0, 200), min_size=1, max_size=100))
def test_expected_is_the_span_and_the_counts_add_up(indices):
    expected, present, lost, duplicated, _ = counts(indices)
    assert expected == max(indices) - min(indices) + 1 == present - duplicated + lost
    assert duplicated == len(indices) - len(set(indices))


@settings(deadline=None, derandomize=True)
@given(st.lists(st.booleans(), max_size=200), st.sets(st.integers(0, 199)), st.sets(st.integers(0, 150)))
def test_watch_counts_the_same_while_samples_arrive(dropped, repeated, swapped):
    indices = [index for index in range(200) if index >= len(dropped) or not dropped[index]]
    indices = [index for index in indices for _ in range(2 if index in repeated else 1)]
    last = -2
    for place in sorted(swapped):
        # A sample that comes one place late, as the network may deliver it.
        if last + 1 < place < len(indices) - 1 and indices[place] not in repeated:
            if indices[place + 1] not in repeated and place > 0:
                indices[place], indices[place + 1] = indices[place + 1], indices[place]
            last = place
    watch = StampWatch(RATE)
    for stamp in stamps_of(indices).tolist():
        watch.add(stamp)
    found = stamp_statistics(stamps_of(indices), RATE)
    assert (watch.present, watch.lost, watch.duplicated, watch.out_of_order) == (
        found.present,
        found.lost,
        found.duplicated,
        found.out_of_order,
    )
