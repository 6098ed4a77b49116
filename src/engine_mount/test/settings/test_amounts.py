"""Sizes and durations as people write them."""

import pytest

from engine_mount.settings.amounts import checked_recorder, duration_in_nanoseconds, recorder_options
from mount_models.quantity import ParameterError


@pytest.mark.parametrize(
    ('texts', 'options'),
    [
        ([], {}),
        (['500MB'], {'split_size': 500_000_000}),
        (['1.5 GiB', '10min'], {'split_size': 3 << 29, 'split_duration': 600.0}),
    ],
)
def test_sizes_and_durations_are_told_apart_by_their_units(texts, options):
    assert recorder_options(texts, '') == pytest.approx(options)


@pytest.mark.parametrize(
    ('texts', 'words'),
    [
        (['500'], 'as in 500MB'),
        (['5parsec'], 'as in 500MB'),
        (['60s', '1h'], 'second limit'),
        (['10kB'], 'at least 1000000'),
        (['20ms'], 'at least 1 s'),
    ],
)
def test_limit_that_makes_no_sense_is_refused(texts, words):
    with pytest.raises(ParameterError, match=words):
        checked_recorder(recorder_options(texts, ''))


def test_a_size_is_no_duration():
    with pytest.raises(ParameterError, match='duration such as 30s'):
        duration_in_nanoseconds('30MB')
