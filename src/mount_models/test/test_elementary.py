"""Elementary functions of our own: as exact as they say, and exact where a user expects it."""

import math
from itertools import pairwise

import numpy as np
import pytest

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import atan, cosines, exp, expm1, log, sine_and_cosine, sines

SMALLEST_NORMAL = np.finfo(float).tiny
LONG = np.longdouble
LONG_PI = LONG('3.14159265358979323846264338327950288419716939937510582')


@compiled
def each(function, x):
    result = np.empty(x.size)
    for k in range(x.size):
        result[k] = function(x[k])
    return result


def spread(*edges, count=40_000):
    """Return numbers evenly and by size between the edges, and the neighbours of each edge."""
    random = np.random.default_rng(1)
    parts = []
    for low, high in pairwise(edges):
        parts.append(random.uniform(low, high, count))
        parts.append(np.copysign(10.0 ** random.uniform(-18.0, 0.0, count), low + high) * max(-low, high))
    near = [edge * (1.0 + np.arange(-500, 501) * 2.0**-52) for edge in edges if edge]
    numbers = np.concatenate([*parts, *near])
    return numbers[(numbers >= edges[0]) & (numbers <= edges[-1])]


def largest_error(found, exact):
    """Return the largest error in units in the last place of the exact result."""
    kept = np.abs(exact) >= SMALLEST_NORMAL
    return float(np.max(np.abs(found[kept] - exact[kept]) / np.spacing(np.abs(exact[kept].astype(float)))))


needs_long_numbers = pytest.mark.skipif(
    np.finfo(LONG).nmant < 63, reason='long numbers are no longer than others on this machine'
)


@needs_long_numbers
@pytest.mark.parametrize(
    ('function', 'exact', 'edges', 'ulp'),
    [
        (exp, np.exp, (-700.0, -1.0, -0.5 * math.log(2.0), 0.0, 0.5 * math.log(2.0), 1.0, 709.7), 1.0),
        (expm1, np.expm1, (-60.0, -40.0, -0.5 * math.log(2.0), 0.0, 0.5 * math.log(2.0), 40.0, 700.0), 2.0),
        (log, np.log, (0.0, math.sqrt(0.5), 1.0, math.sqrt(2.0), 2.0, 1e308), 1.0),
        (log, np.log, (0.5, 0.999, 1.001, 2.0), 1.0),
        (atan, np.arctan, (-9.0, 0.0, math.sqrt(2.0) - 1.0, 1.0, math.sqrt(2.0) + 1.0, 9.0, 1e18), 2.0),
    ],
)
def test_errors_stay_within_what_is_promised(function, exact, edges, ulp):
    x = spread(*edges)
    assert largest_error(each(function, x), exact(x.astype(LONG))) <= ulp


@needs_long_numbers
def test_sine_and_cosine_stay_within_two_units_everywhere_on_the_circle():
    turns = np.concatenate([spread(-0.5, -0.375, -0.125, 0.0, 0.125, 0.25, 0.375, 0.5), spread(0.5, 1000.0)])
    quarters = np.rint(4.0 * turns)
    rest = 2 * LONG_PI * (turns.astype(LONG) - quarters.astype(LONG) / 4)
    sine, cosine = np.sin(rest), np.cos(rest)
    place = quarters.astype(np.int64) % 4
    exact_sines = np.choose(place, [sine, cosine, -sine, -cosine])
    exact_cosines = np.choose(place, [cosine, -sine, -cosine, sine])
    assert largest_error(sines(turns), exact_sines) <= 2.0
    assert largest_error(cosines(turns), exact_cosines) <= 2.0


def test_quarter_turns_and_the_zeros_are_met_exactly():
    assert [sine_and_cosine(0.25 * k) for k in range(-4, 5)] == [
        (0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0),
        (0.0, 1.0),
    ]  # fmt: skip
    assert sine_and_cosine(2.0**60 + 0.0) == (0.0, 1.0)
    assert (exp(0.0), expm1(0.0), log(1.0), atan(0.0)) == (1.0, 0.0, 0.0, 0.0)
    assert [log(2.0**k) / math.log(2.0) for k in (-1074, -1022, -1, 1, 1023)] == pytest.approx(
        [-1074, -1022, -1, 1, 1023], rel=4e-16
    )


def test_ends_of_the_range_and_what_is_no_number():
    assert [exp(x) for x in (-math.inf, -746.0, 710.0, math.inf)] == [0.0, 0.0, math.inf, math.inf]
    assert exp(-745.1) == 5e-324
    assert exp(709.78) == pytest.approx(1.7928227943945155e308, rel=2e-16)
    assert [expm1(x) for x in (-math.inf, math.inf)] == [-1.0, math.inf]
    assert [log(x) for x in (0.0, math.inf)] == [-math.inf, math.inf]
    assert [atan(x) for x in (-math.inf, math.inf)] == [-0.5 * math.pi, 0.5 * math.pi]
    for function in (exp, expm1, log, atan):
        assert math.isnan(function(math.nan))
    assert math.isnan(log(-1e-320))
    assert all(math.isnan(value) for x in (math.nan, math.inf) for value in sine_and_cosine(x))
