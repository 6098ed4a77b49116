"""Mean and standard deviation with sums of fixed order."""

import math

import numpy as np
import pytest

from mount_models.arithmetic.sums import mean, standard_deviation

VALUES = np.random.default_rng(3).normal(20e-3, 1e-4, 501)


def test_they_are_what_their_names_say():
    assert mean(VALUES) == pytest.approx(math.fsum(VALUES) / VALUES.size, rel=1e-15)
    assert standard_deviation(VALUES) == pytest.approx(np.std(VALUES, ddof=1), rel=1e-12)


def test_they_sum_from_the_first_to_the_last():
    assert mean(np.array([1e16, 1.0, -1e16, 1.0])) == 0.25


def test_too_few_values_give_no_number():
    assert math.isnan(mean(np.empty(0)))
    assert math.isnan(standard_deviation(np.ones(1)))
