"""Random numbers that their seed repeats."""

import numpy as np
import pytest
from scipy.stats import kstest

from mount_sim.random_numbers import RandomNumbers

UNIFORM = ['0x1.060d7be6f245cp-1', '0x1.e6a32d7782a55p-1']
NORMAL = ['-0x1.faa9919694f12p-1', '0x1.d5fe43b6020c8p-2', '-0x1.6936c9867ccd4p-3']


def test_the_sequence_of_a_seed_is_for_ever_this():
    assert [number.hex() for number in RandomNumbers(1).uniform(2)] == UNIFORM
    assert [number.hex() for number in RandomNumbers([1, 2]).normal(1, 3)[0]] == NORMAL


def test_even_numbers_are_those_of_numpy():
    assert np.array_equal(RandomNumbers(7).uniform(1000), np.random.default_rng(7).random(1000))


def test_normal_numbers_are_normal_also_far_out():
    numbers = RandomNumbers(5).normal(1000, 400).ravel()
    assert kstest(numbers, 'norm').pvalue > 0.01
    assert np.corrcoef(numbers[::2], numbers[1::2])[0, 1] == pytest.approx(0.0, abs=5e-3)
    far = np.abs(numbers) > 4.0  # 6.3e-5 of all
    assert 10 <= np.count_nonzero(far) <= 45
    assert np.isfinite(numbers).all()


def test_blocks_go_on_where_the_one_before_ended():
    together, parts = RandomNumbers(2), RandomNumbers(2)
    assert np.array_equal(together.normal(6, 4), np.vstack([parts.normal(4, 4), parts.normal(2, 4)]))
