"""Evenly spaced samples at another rate, limited to the band that both rates hold.

Each result is a sum of samples under a sinc in a Kaiser window, which reaches 26 samples of the slower rate f
to either side. Of a sine, relative to its amplitude (held by a test):

| frequency | comes out |
|---|---|
| 0 .. 0.4 f | true within 2e-4 |
| 0.45 f | halved |
| from 0.5 f on (images of samples, or what the slower rate cannot hold) | below 2e-4 |

A step overshoots by 13 % of its height; no samples at all leave their range by more than 0.6 of it. Before
the first sample and behind the last the signal stands still.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.plausibility import OVERSHOOT, check_range
from engine_mount.signals.signal import FloatArray
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import sine_and_cosine
from mount_models.arithmetic.series import StreamedSeries, series_of

HALF_LENGTH = 26  # samples of the slower rate
CUTOFF = 0.45  # of the slower rate, chosen: what is left at its half is as small as the window allows
_SHAPE = 7.857  # Kaiser's beta for 80 dB
_PHASES = 1024  # points of the kernel for each sample; between them it is straight, within 1e-6
_COARSE = 4  # points to a period of the slower rate
_WITHOUT_DOUBT = 0.9  # of what is allowed, chosen: 8 % for what lies between the points, and some more
_SAME = 0.1  # samples, chosen: grids that run apart by no more over the whole signal are one


def resampled(
    even: EvenSignal, step_time: float, first: float = 0.0, count: int | None = None
) -> StreamedSeries:
    """Return `count` values `step_time` (s) apart, from `first` (s after the first sample) on.

    Without `count` up to before the last sample. A signal that has that step already is not touched. Raises
    `SignalError` for a result that its samples do not bear out.
    """
    if first == 0.0 and has_step(even, step_time):
        return series_of(even.values[:count])
    if count is None:
        count = max(1, math.ceil(even.length / step_time - 1e-6))
    grid, kernel = _Grid(even.period, first, step_time), _kernel()
    _check(even, grid, count, kernel)
    return StreamedSeries(count, lambda begin, behind: _filtered(even.values, grid, begin, behind, kernel))


class _Grid(NamedTuple):
    """Where results stand: period of the samples, time of the first result, time between results, in s."""

    period: float
    first: float
    step_time: float


def _check(even: EvenSignal, grid: _Grid, count: int, kernel: FloatArray) -> None:
    """Raise `SignalError` where one of `count` results leaves the range of the samples too far.

    The results are band-limited to half the slower rate. What a signal of that band does on a grid of four
    points to the slower rate's period, to both sides as far as the kernel reaches, it exceeds between them by
    no more than 1 / cos(pi / 8), or 8 % (Duffin and Schaeffer, 1945). Most signals pass by that.
    """
    low, high = float(even.values.min()), float(even.values.max())
    slower = max(grid.period, grid.step_time)
    if slower > _COARSE * grid.step_time:
        reach = HALF_LENGTH * slower
        coarse = grid._replace(first=grid.first - reach, step_time=slower / _COARSE)
        points = math.ceil(((count - 1) * grid.step_time + 2.0 * reach) / coarse.step_time) + 1
        _, value = _farthest(even.values, coarse, points, kernel, 0.5 * (low + high))
        if abs(value - 0.5 * (low + high)) <= _WITHOUT_DOUBT * (0.5 + OVERSHOOT) * (high - low):
            return
    number, value = _farthest(even.values, grid, count, kernel, 0.5 * (low + high))
    check_range(even, value, grid.first + number * grid.step_time, low, high)


def has_step(even: EvenSignal, step_time: float) -> bool:
    """Return whether the samples stand on a grid of `step_time` (s) as they are."""
    return len(even.values) * abs(even.period - step_time) <= _SAME * step_time


@functools.cache
def _kernel() -> FloatArray:
    """Return the kernel over distance, `_PHASES` points for each sample of the slower rate."""
    kernel = np.array([_kernel_at(point / _PHASES) for point in range(HALF_LENGTH * _PHASES + 2)])
    kernel.flags.writeable = False
    return kernel


@compiled
def _filtered(values, grid, begin, behind, kernel):
    """Return the results `begin` .. `behind` - 1."""
    result = np.empty(behind - begin)
    for number in range(begin, behind):
        result[number - begin] = _result(values, grid, number, kernel)
    return result


@compiled
def _farthest(values, grid, count, kernel, middle):
    """Return number and value of that of the first `count` results that lies farthest from `middle`."""
    farthest, value = 0, middle
    for number in range(count):
        result = _result(values, grid, number, kernel)
        if abs(result - middle) > abs(value - middle):
            farthest, value = number, result
    return farthest, value


@compiled
def _result(values, grid, number, kernel):
    slower = max(grid.period, grid.step_time)
    reach = HALF_LENGTH * slower / grid.period
    at = (grid.first + number * grid.step_time) / grid.period
    total, weights = 0.0, 0.0
    for place in range(math.ceil(at - reach), math.floor(at + reach) + 1):
        distance = abs(at - place) * (grid.period / slower) * _PHASES
        point = int(distance)
        weight = kernel[point] + (distance - point) * (kernel[point + 1] - kernel[point])
        total += weight * values[min(max(place, 0), values.size - 1)]
        weights += weight
    return total / weights  # a constant comes out as it went in


@compiled
def _kernel_at(distance: float) -> float:
    if distance >= HALF_LENGTH:
        return 0.0
    share = distance / HALF_LENGTH
    window = _bessel(_SHAPE * math.sqrt(1.0 - share * share)) / _bessel(_SHAPE)
    turns = 2.0 * CUTOFF * distance
    return window if turns == 0.0 else window * sine_and_cosine(0.5 * turns)[0] / (math.pi * turns)


@compiled
def _bessel(argument: float) -> float:
    """Return the modified Bessel function I0 by its series: `np.i0` differs by processor."""
    term, total, number = 1.0, 1.0, 0
    while term > 1e-17 * total:
        number += 1
        term *= (0.5 * argument / number) ** 2
        total += term
    return total
