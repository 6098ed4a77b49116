"""Sizes and durations as people write them."""

import pytest

from engine_mount.settings.options import checked_recorder, duration_in_nanoseconds, recorder_options
from mount_models.quantity import ParameterError


def test_a_size_has_a_unit():
    assert recorder_options('1.5 GiB') == {'split_size': 3 << 29}
    for text in ('500', 'fast', '5parsec', '60s'):
        with pytest.raises(ParameterError, match='size such as 500MB'):
            recorder_options(text)
    with pytest.raises(ParameterError, match='at least 1000000'):
        checked_recorder(recorder_options('10kB'))


def test_a_size_is_no_duration():
    with pytest.raises(ParameterError, match='duration such as 30s'):
        duration_in_nanoseconds('30MB')
