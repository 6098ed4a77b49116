"""Stamps of every kind become even spacing, or are refused with the place."""

import numpy as np
import pytest

from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.signal import SignalError, mean, signal_of
from mount_models.arithmetic import sums

PERIOD = 0.01
COUNT = 3000
NUMBERS = np.arange(COUNT)
TIMES = PERIOD * NUMBERS


VALUES = sum(a * np.sin(2.0 * np.pi * f * TIMES + f) for a, f in ((1, 1.3), (2, 7.7), (0.8, 12), (0.3, 19)))


def even(times, values=VALUES, longest_gap=0.125):
    return evenly_spaced(signal_of('z', times, values), longest_gap, 50.0)


def refusal(times, values=VALUES):
    with pytest.raises(SignalError) as caught:
        even(times, values)
    return str(caught.value)


def changed(place, stamp):
    times = TIMES.copy()
    times[place] = stamp
    return times


def test_even_stamps_change_nothing():
    found = even(TIMES + 46_000.0)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-9)
    assert found.begin == 46_000_000_000_000
    assert found.notes == ()


def test_stamps_that_jitter_about_even_samples_change_none():
    found = even(TIMES + np.random.default_rng(1).uniform(-0.3, 0.3, COUNT) * PERIOD)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-3)
    assert 'taken as evenly spaced at 100 Hz' in found.notes[0]


def test_samples_taken_at_uneven_times_are_brought_onto_the_grid():
    times = TIMES + 0.5 * PERIOD * np.sin(2.0 * np.pi * 0.1 * TIMES)  # a clock that runs unevenly
    found = even(times, np.sin(2.0 * np.pi * 8.0 * times))
    at = times[0] + found.period * np.arange(len(found.values))
    assert np.abs(found.values - np.sin(2.0 * np.pi * 8.0 * at)).max() < 0.002
    assert 'brought from uneven stamps' in found.notes[0]


def test_samples_recorded_twice_count_once():
    for times, values in (
        (np.repeat(TIMES, 2), np.repeat(VALUES, 2)),
        (np.insert(TIMES, 5, TIMES[5]), np.insert(VALUES, 5, VALUES[5])),
    ):
        np.testing.assert_array_equal(even(times, values).values, VALUES)


def test_lost_samples_are_interpolated_and_move_no_other():
    kept = np.delete(NUMBERS, [500, 1200, 1201, 1202, 1203, 1204])
    found = even(TIMES[kept], VALUES[kept])
    np.testing.assert_allclose(found.values[kept], VALUES[kept], atol=1e-9)
    assert np.abs(found.values[500] - VALUES[500]) < 0.1
    assert found.notes == ('2 gaps are interpolated, the longest of 60 ms at 11.990 s',)


def test_what_fills_a_gap_stays_near_the_samples_beside_it():
    values = np.where(NUMBERS == 1999, 50.0, 0.0) - np.where(NUMBERS == 1998, 50.0, 0.0)
    kept = np.delete(NUMBERS, np.arange(2000, 2009))
    assert np.abs(even(TIMES[kept], values[kept]).values).max() <= 100.0


@pytest.mark.parametrize(
    ('times', 'reason'),
    [
        (TIMES[::-1], 'time does not rise at sample 1: 0.000000 s is followed by -0.010000 s'),
        (changed(7, 1.0), 'time does not rise at sample 8: 1.000000 s is followed by 0.080000 s'),
        (TIMES * 1000.0, 'has 0.1 samples per second (is its time in seconds?)'),
        (TIMES * 2.1, 'at least 50 are needed'),
        (TIMES + 0.12 * (NUMBERS > 500), 'has a gap of 0.130 s at 5.000 s; up to 0.125 s are interpolated'),
        (TIMES + 0.2 * (NUMBERS > COUNT - 10), 'has a gap of 0.210 s at 29.900 s'),
        (
            changed(1000, TIMES[999] + 1e-6),
            'samples 999 and 1000 are 0.001 ms apart at 9.990 s, less than 2.5 ms: say their --rate',
        ),
        (PERIOD * (NUMBERS // 5 * 5 + 4), 'say their --rate if they were taken evenly'),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_place(times, reason):
    assert reason in refusal(times)


def test_a_clock_that_runs_a_little_slow_has_the_rate_of_its_name():
    signal = signal_of('z', 1.004 * TIMES, VALUES)
    assert evenly_spaced(signal, 0.125, 100.0).rate == pytest.approx(99.6, rel=1e-3)
    with pytest.raises(SignalError, match='at least 101 are needed'):
        evenly_spaced(signal, 0.125, 101.0)


def test_the_mean_of_a_signal_is_the_ordered_sum_to_the_bit():
    values = np.random.default_rng(3).normal(size=10_001)
    assert mean(values) == sums.mean(values) != np.mean(values)
