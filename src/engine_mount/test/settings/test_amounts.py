"""Sizes and durations as people write them."""

import pytest

from engine_mount.settings.amounts import duration_in_nanoseconds, split_rule
from mount_models.quantity import ParameterError
from mount_recorder.bag_writer import SplitRule


@pytest.mark.parametrize(
    ('texts', 'rule'),
    [
        ([], SplitRule()),
        (['500MB'], SplitRule(size=500_000_000)),
        (['60s'], SplitRule(duration=60_000_000_000)),
        (['1.5 GiB', '10min'], SplitRule(3 << 29, 600_000_000_000)),
    ],
)
def test_sizes_and_durations_are_told_apart_by_their_units(texts, rule):
    assert split_rule(texts) == rule


@pytest.mark.parametrize(
    ('texts', 'word'),
    [
        (['500'], 'write 500MB'),
        (['fast'], 'write 500MB'),
        (['5parsec'], 'write 500MB'),
        (['60s', '1h'], 'second limit'),
        (['10kB'], 'at least 1000000'),
        (['20ms'], 'at least 1 s'),
    ],
)
def test_limit_that_makes_no_sense_is_refused(texts, word):
    with pytest.raises(ParameterError, match=word):
        split_rule(texts)


def test_a_size_is_no_duration():
    with pytest.raises(ParameterError, match='duration such as 30s'):
        duration_in_nanoseconds('30MB')
