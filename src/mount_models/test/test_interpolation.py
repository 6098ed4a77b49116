"""Straight lines between points of a table."""

import math

import numpy as np
import pytest

from mount_models.arithmetic.sums import each_interpolated, interpolated

X, Y = np.array([0.0, 1.0, 1.5, 4.0]), np.array([2.0, 5.0, -1.0, 0.0])


def test_points_are_met_and_lines_lie_between():
    assert each_interpolated(X, X, Y).tolist() == Y.tolist()
    x = np.linspace(-1.0, 5.0, 601)
    assert each_interpolated(x, X, Y) == pytest.approx(np.interp(x, X, Y), abs=1e-14)


def test_beyond_the_ends_the_last_value_holds_and_no_number_stays_none():
    assert [interpolated(x, X, Y) for x in (-math.inf, -1.0, 9.0, math.inf)] == [2.0, 2.0, 0.0, 0.0]
    assert math.isnan(interpolated(math.nan, X, Y))


def test_a_table_of_one_point_is_constant():
    assert each_interpolated(np.array([-1.0, 0.5, 9.0]), X[:1], Y[:1]).tolist() == [2.0, 2.0, 2.0]
