"""Missing, repeated and late samples, in one go and one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import PERIOD, START

from engine_mount.recordings.times import misdated, missing_samples, redated, stamp_statistics
from mount_recorder.stamp_watch import StampWatch

RATE = 1000.0


def stamps_of(indices):
    return np.array([START + index * PERIOD for index in indices], np.int64)


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


FAR_OFF = {
    'future': (1 << 31) * 10**9,
    'past': -(10**15),
    'tomorrow': 86_400 * 10**9,
    'a minute': -60 * 10**9,
}


@pytest.mark.parametrize('place', [0, 1, 7, 500, 997, 998, 999])
@pytest.mark.parametrize('off', FAR_OFF.values(), ids=FAR_OFF)
def test_a_stamp_far_off_is_misdated_and_no_loss(off, place):
    stamps = START + PERIOD * np.arange(1000)
    told = stamps.copy()
    told[place] += off
    wrong = misdated(told)
    assert np.flatnonzero(wrong).tolist() == [place]
    assert (redated(told, wrong, RATE) == stamps).all()


@pytest.mark.parametrize('off', FAR_OFF.values(), ids=FAR_OFF)
def test_watch_counts_a_stamp_far_off_as_that_alone(off):
    watch = StampWatch(RATE)
    for index in range(1000):
        watch.add(START + PERIOD * index + (off if index == 500 else 0))
    # The sample that came with it has no time: its place stays empty.
    assert (watch.misdated, watch.lost, watch.duplicated, watch.out_of_order) == (1, 1, 0, 0)


def test_watch_goes_on_behind_a_pause_and_behind_a_clock_that_was_set():
    watch = StampWatch(RATE)
    for index in [*range(1000), *range(61_000, 62_000)]:
        watch.add(START + PERIOD * index)
    assert (watch.misdated, watch.lost) == (0, 60_000)
    for index in range(1000):
        watch.add(START - 10**15 + PERIOD * index)
    assert (watch.misdated, watch.lost, watch.out_of_order) == (1, 60_000, 0)


def test_samples_missing_for_a_year_are_counted_without_a_list_of_them():
    year = 365 * 86_400
    streams = [np.array([0, year * 1_000_000_000]), np.array([0, 1_000_000, year * 1_000_000_000])]
    assert missing_samples(streams, 1000.0) == 1000 * year - 1
