"""Least squares of our own against those of numpy, which pass LAPACK."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mount_models.arithmetic.sums import combination_std, least_squares


@given(st.integers(1, 5), st.integers(0, 40), st.integers(0, 2**32 - 1))
def test_they_are_those_of_lapack(unknowns, more, seed):
    random = np.random.default_rng(seed)
    matrix, values = random.normal(size=(unknowns + more, unknowns)), random.normal(size=unknowns + more)
    found, triangle = least_squares(matrix, values)
    assert found == pytest.approx(np.linalg.lstsq(matrix, values, rcond=None)[0], rel=1e-9, abs=1e-9)
    weights = random.normal(size=unknowns)
    variance = weights @ np.linalg.inv(matrix.T @ matrix) @ weights
    assert combination_std(triangle, weights) == pytest.approx(np.sqrt(variance), rel=1e-6)
    assert np.array_equal(triangle, np.triu(triangle))


def test_arguments_are_left_as_they_are():
    matrix, values = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), np.array([1.0, 3.0, 5.0])
    found, _ = least_squares(matrix, values)
    assert found == pytest.approx([1.0, 2.0], abs=1e-15)
    assert matrix.tolist() == [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]
    assert values.tolist() == [1.0, 3.0, 5.0]


def test_columns_that_depend_on_each_other_give_no_number():
    found, _ = least_squares(np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 2.0, 3.0]))
    assert not np.isfinite(found).all()
