"""Each displacement sample is judged by its stamp and value before the controller sees it."""

import math

import pytest

from mount_control.sample_watch import Judgement, SampleCounts, SampleWatch

MS = 1_000_000  # ns


@pytest.fixture
def watch():
    watch = SampleWatch(0.001, 0.020, 0.020)
    assert watch.judge(1000 * MS, 0.0) == (Judgement.RESTART, 0)  # the first one has no past
    return watch


def _judge(watch, *milliseconds, displacement=0.0):
    return [watch.judge(round(1000 * MS + ms * MS), displacement) for ms in milliseconds]


def test_samples_in_time_are_used(watch):
    assert _judge(watch, 1, 2, 3) == [(Judgement.USE, 0)] * 3
    assert watch.counts == SampleCounts(samples=4, restarts=1)
    assert watch.last_stamp == 1003 * MS


@pytest.mark.parametrize('jitter', [-0.49, -0.1, 0.1, 0.49])
def test_a_stamp_a_little_early_or_late_is_no_missing_sample(watch, jitter):
    assert _judge(watch, 1 + jitter) == [(Judgement.USE, 0)]


@pytest.mark.parametrize('missing', [1, 2, 7, 19])
def test_missing_samples_are_counted_from_the_stamps(watch, missing):
    assert _judge(watch, missing + 1) == [(Judgement.USE, missing)]
    assert watch.counts.bridged == missing


def test_after_too_long_a_gap_the_past_is_forgotten(watch):
    assert _judge(watch, 20.000001, 21) == [(Judgement.RESTART, 0), (Judgement.USE, 0)]
    assert watch.counts == SampleCounts(samples=3, restarts=2)


@pytest.mark.parametrize('late_by', [0, 1, 300])
def test_repeated_and_overtaken_samples_are_ignored(watch, late_by):
    _judge(watch, 1, 2)
    assert _judge(watch, 2 - late_by) == [(Judgement.IGNORE, 0)]
    assert watch.counts.ignored == 1
    assert _judge(watch, 3) == [(Judgement.USE, 0)]


@pytest.mark.parametrize('displacement', [math.nan, math.inf, -math.inf, 0.020001, -0.020001])
def test_what_no_sensor_can_mean_is_invalid(watch, displacement):
    assert _judge(watch, 1, displacement=displacement) == [(Judgement.INVALID, 0)]
    assert watch.counts.invalid == 1
    assert watch.counts.samples == 1


@pytest.mark.parametrize('displacement', [0.020, -0.020])
def test_the_end_of_the_range_still_counts(watch, displacement):
    assert _judge(watch, 1, displacement=displacement) == [(Judgement.USE, 0)]


def test_invalid_samples_are_bridged_like_missing_ones(watch):
    _judge(watch, 1, 2, 3, displacement=math.nan)
    assert _judge(watch, 4) == [(Judgement.USE, 3)]
    _judge(watch, *range(5, 30), displacement=math.nan)
    assert _judge(watch, 30) == [(Judgement.RESTART, 0)]
