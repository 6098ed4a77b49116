"""Stamps of every kind become even spacing, or are refused with the place."""

import numpy as np
import pytest

from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.resampling import resampled
from engine_mount.signals.signal import SignalError, signal_of

PERIOD = 0.01
COUNT = 3000
NUMBERS = np.arange(COUNT)
TIMES = PERIOD * NUMBERS


def drive(times):
    """Body, engine and wheel of a car, 1.3 to 19 Hz, and so much of each that the largest is about 4."""
    return sum(
        a * np.sin(2.0 * np.pi * f * times + p)
        for a, f, p in ((1, 1.3, 0), (2, 7.7, 1), (0.8, 12, 2), (0.3, 19, 3))
    )


VALUES = drive(TIMES)


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


def random(seed=1):
    return np.random.default_rng(seed)


def test_even_stamps_change_nothing():
    found = even(TIMES + 46_000.0)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-9)
    assert found.begin == 46_000_000_000_000
    assert found.notes == ()


@pytest.mark.parametrize(
    'times',
    [
        changed(1000, TIMES[999] + 1e-6),
        changed(1000, TIMES[1001] - 1e-6),
        changed(1000, TIMES[999]),
        changed(1000, TIMES[1000] + 0.006),
    ],
    ids=['1 us after the one before', '1 us before the next', 'equal', 'late'],
)
def test_one_wrong_stamp_changes_no_sample(times):
    found = even(times)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-5)
    assert 'taken as evenly spaced at 100 Hz' in found.notes[0]


@pytest.mark.parametrize('burst', [2, 5, 20])
@pytest.mark.parametrize('inside', [0.0, 1e-4])
def test_samples_that_arrive_in_bursts_are_even(burst, inside):
    arrival = PERIOD * (NUMBERS // burst * burst + burst - 1) + inside * (NUMBERS % burst)
    late = random().uniform(0.0, 0.004, COUNT)[NUMBERS // burst]
    found = even(arrival + late)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-3)


@pytest.mark.parametrize(
    'late',
    [
        random().uniform(-0.3, 0.3, COUNT) * PERIOD,
        random().exponential(0.003, COUNT),
        np.round(TIMES * 0.97, 2) - TIMES * 0.97,
    ],
    ids=['jitter', 'latency', 'coarse'],
)
def test_stamps_that_jitter_about_even_samples_change_none(late):
    found = even(TIMES + late)
    np.testing.assert_array_equal(found.values, VALUES)
    assert found.rate == pytest.approx(100.0, rel=1e-3)


def test_samples_taken_at_uneven_times_are_brought_onto_the_grid():
    times = TIMES + random().uniform(-0.3, 0.3, COUNT) * PERIOD
    found = even(times, np.sin(2.0 * np.pi * 8.0 * times))
    at = times[0] + found.period * np.arange(len(found.values))
    assert np.abs(found.values - np.sin(2.0 * np.pi * 8.0 * at)).max() < 0.02


def test_a_sample_too_many_is_averaged_with_the_one_beside_it():
    times, values = np.insert(TIMES, 1001, TIMES[1000] + 1e-6), np.insert(VALUES, 1001, VALUES[1000] + 0.2)
    found = even(times, values)
    expected = VALUES.copy()
    expected[1000] += 0.1
    np.testing.assert_allclose(found.values, expected, atol=1e-3)
    assert '1 samples within 2.5 ms of the one before are averaged with it' in found.notes[0]


def test_samples_recorded_twice_count_once():
    for times, values in (
        (np.repeat(TIMES, 2), np.repeat(VALUES, 2)),
        (np.insert(TIMES, 5, TIMES[5]), np.insert(VALUES, 5, VALUES[5])),
    ):
        np.testing.assert_array_equal(even(times, values).values, VALUES)


def test_a_sample_that_comes_late_in_the_file_is_put_in_its_place():
    order = NUMBERS.copy()
    order[[700, 701]] = order[[701, 700]]
    np.testing.assert_array_equal(even(TIMES[order], VALUES[order]).values, VALUES)


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
        (np.zeros(COUNT), 'time does not rise at sample 1'),
        (changed(7, 1.0), 'time does not rise at sample 8: 1.000000 s is followed by 0.080000 s'),
        (TIMES * 1000.0, 'has 0.1 samples per second (is its time in seconds?)'),
        (TIMES * 2.1, 'at least 50 are needed'),
        (TIMES + 0.12 * (NUMBERS > 500), 'has a gap of 0.130 s at 5.000 s; up to 0.125 s are interpolated'),
        (TIMES + 3.0 * (NUMBERS > 500), 'has a gap of 3.010 s at 5.000 s'),
        (TIMES + 0.2 * (NUMBERS > COUNT - 10), 'has a gap of 0.210 s at 29.900 s'),
        (changed(9, TIMES[8] + 1e-6) + 0.2 * (NUMBERS > COUNT - 10), 'has a gap of 0.210 s at 29.900 s'),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_place(times, reason):
    assert reason in refusal(times)


def test_a_clock_that_runs_a_little_slow_has_the_rate_of_its_name():
    signal = signal_of('z', 1.004 * TIMES, VALUES)
    assert evenly_spaced(signal, 0.125, 100.0).rate == pytest.approx(99.6, rel=1e-3)
    with pytest.raises(SignalError, match='at least 101 are needed'):
        evenly_spaced(signal, 0.125, 101.0)


def test_no_error_of_a_stamp_makes_a_spike():
    """Two stamps 1 us apart, anywhere, leave what is resampled nearly as it was."""
    clean = resampled(even(TIMES), 1e-3)[:]
    for place in random(5).integers(1, COUNT, 30).tolist():
        wrong = resampled(even(changed(place, TIMES[place - 1] + 1e-6)), 1e-3)[:]
        length = min(len(wrong), len(clean))
        assert np.abs(wrong[:length] - clean[:length]).max() < 0.02
