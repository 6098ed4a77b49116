"""Sums of fixed order: mean, standard deviation, lines in a table and least squares."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mount_models.arithmetic.sums import (
    combination_std,
    each_interpolated,
    interpolated,
    least_squares,
    mean,
    standard_deviation,
)

VALUES = np.random.default_rng(3).normal(20e-3, 1e-4, 501)


def test_they_are_what_their_names_say():
    assert mean(VALUES) == pytest.approx(math.fsum(VALUES) / VALUES.size, rel=1e-15)
    assert standard_deviation(VALUES) == pytest.approx(np.std(VALUES, ddof=1), rel=1e-12)


def test_they_sum_from_the_first_to_the_last():
    assert mean(np.array([1e16, 1.0, -1e16, 1.0])) == 0.25


def test_too_few_values_give_no_number():
    assert math.isnan(mean(np.empty(0)))
    assert math.isnan(standard_deviation(np.ones(1)))


X, Y = np.array([0.0, 1.0, 1.5, 4.0]), np.array([2.0, 5.0, -1.0, 0.0])


def test_points_are_met_and_lines_lie_between():
    assert each_interpolated(X, X, Y).tolist() == Y.tolist()
    x = np.linspace(-1.0, 5.0, 601)
    assert each_interpolated(x, X, Y) == pytest.approx(np.interp(x, X, Y), abs=1e-14)


def test_beyond_the_ends_the_last_value_holds_and_no_number_stays_none():
    assert [interpolated(x, X, Y) for x in (-math.inf, -1.0, 9.0, math.inf)] == [2.0, 2.0, 0.0, 0.0]
    assert math.isnan(interpolated(math.nan, X, Y))


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


def test_columns_that_depend_on_each_other_give_no_number():
    found, _ = least_squares(np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 2.0, 3.0]))
    assert not np.isfinite(found).all()
