"""A signal at other times: cubic spline and band-limited change of rate, the same bits on every processor.

SciPy's pass LAPACK and the C library; tests hold these against them.
"""

import math

import numpy as np
import numpy.typing as npt

from mount_models.compiled import compiled
from mount_models.elementary import sine_and_cosine

FloatArray = npt.NDArray[np.float64]

_KAISER = 5.0  # shape of the window, chosen: 60 dB
_PERIODS = 10  # of the lower rate on either side, chosen


def spline(times: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return the cubic spline through `values` (n,) over rising `times` (n,), n > 3, at the rising `at` (m,).

    The third derivative is steady at the second and last but one point; the pieces at the ends go on.
    """
    times, values, at = (np.ascontiguousarray(row, float) for row in (times, values, at))
    return _spline_at(times, values, _slopes(times, values), at)


def change_rate(values: FloatArray, up: int, down: int) -> FloatArray:
    """Return even samples `values` (n,) at `up` / `down` times their rate, (ceil(n up / down),).

    Band-limited to the lower of both rates by a sinc under Kaiser's window, without delay; before and behind
    the samples lie zeros.
    """
    common = math.gcd(up, down)
    up, down = up // common, down // common
    return _filtered(np.ascontiguousarray(values, float), _low_pass(max(up, down)) * up, up, down)


@compiled
def _slopes(times, values):
    """Return the slopes of the spline at its points: a tridiagonal system, solved from its first row on."""
    count = times.size
    steps, rises = np.diff(times), np.empty(count - 1)
    for k in range(count - 1):
        rises[k] = (values[k + 1] - values[k]) / steps[k]
    diagonal, upper, right = np.empty(count), np.empty(count), np.empty(count)
    diagonal[0], upper[0] = steps[1], steps[0] + steps[1]
    right[0] = _end_condition(steps[0], steps[1], rises[0], rises[1])
    for k in range(1, count):
        if k < count - 1:
            lower, own, upper[k] = steps[k], 2.0 * (steps[k - 1] + steps[k]), steps[k - 1]
            wanted = 3.0 * (steps[k] * rises[k - 1] + steps[k - 1] * rises[k])
        else:
            lower, own, upper[k] = steps[k - 1] + steps[k - 2], steps[k - 2], 0.0
            wanted = _end_condition(steps[k - 1], steps[k - 2], rises[k - 1], rises[k - 2])
        share = lower / diagonal[k - 1]
        diagonal[k] = own - share * upper[k - 1]
        right[k] = wanted - share * right[k - 1]
    slopes = np.empty(count)
    slopes[count - 1] = right[count - 1] / diagonal[count - 1]
    for k in range(count - 2, -1, -1):
        slopes[k] = (right[k] - upper[k] * slopes[k + 1]) / diagonal[k]
    return slopes


@compiled
def _end_condition(step, next_step, rise, next_rise):
    both = step + next_step
    return ((step + 2.0 * both) * next_step * rise + step * step * next_rise) / both


@compiled
def _spline_at(times, values, slopes, at):
    result, piece = np.empty(at.size), 0
    for k in range(at.size):
        while piece < times.size - 2 and at[k] >= times[piece + 1]:
            piece += 1
        step = times[piece + 1] - times[piece]
        share = (at[k] - times[piece]) / step
        rest = 1.0 - share
        ends = rest * rest * (1.0 + 2.0 * share) * values[piece]
        ends += share * share * (1.0 + 2.0 * rest) * values[piece + 1]
        bend = share * rest * step * (rest * slopes[piece] - share * slopes[piece + 1])
        result[k] = ends + bend
    return result


@compiled
def _low_pass(ratio):
    """Return the filter (2 n + 1,) that leaves 1 / `ratio` of the band; its sum is 1."""
    half = _PERIODS * ratio
    taps, total = np.empty(2 * half + 1), 0.0
    for place in range(-half, half + 1):
        share = place / half
        tap = _bessel_i0(_KAISER * math.sqrt(1.0 - share * share))
        if place != 0:
            angle = math.pi * place / ratio
            tap *= sine_and_cosine(0.5 * place / ratio)[0] / angle
        taps[place + half] = tap
        total += tap
    return taps / total


@compiled
def _bessel_i0(x):
    """Return the modified Bessel function I_0 by its power series; x of some units."""
    term, total, k = 1.0, 1.0, 1
    while term > 1e-17 * total:
        term *= 0.25 * x * x / (k * k)
        total += term
        k += 1
    return total


@compiled
def _filtered(values, taps, up, down):
    half = taps.size // 2
    result = np.zeros(-(-values.size * up // down))
    for k in range(result.size):
        place = k * down
        first = max(-((half - place) // up), 0)
        last = min((place + half) // up, values.size - 1)
        for j in range(first, last + 1):
            result[k] += values[j] * taps[place - j * up + half]
    return result
