"""Evenly spaced samples at another rate, limited to the band that both rates hold.

Each result is a sum of samples under a sinc in a Kaiser window, which reaches 26 samples of the slower rate f
to either side. Of a sine, relative to its amplitude (held by a test):

| frequency | comes out |
|---|---|
| 0 .. 0.4 f | true within 2e-4 |
| 0.45 f | halved |
| from 0.5 f on (images of samples, or what the slower rate cannot hold) | below 2e-4 |

A step overshoots by 13 % of its height; no result leaves the range of its samples by more than 0.6 of it.
Before the first sample and behind the last the signal stands still.
"""

import functools
import math

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.signal import FloatArray
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import sine_and_cosine
from mount_models.arithmetic.series import StreamedSeries, series_of

HALF_LENGTH = 26  # samples of the slower rate
CUTOFF = 0.45  # of the slower rate, chosen: what is left at its half is as small as the window allows
_SHAPE = 7.857  # Kaiser's beta for 80 dB
_PHASES = 1024  # points of the kernel for each sample; between them it is straight, within 1e-6
_SAME = 0.1  # samples, chosen: grids that run apart by no more over the whole signal are one


def resampled(
    even: EvenSignal, step_time: float, first: float = 0.0, count: int | None = None
) -> StreamedSeries:
    """Return `count` values `step_time` (s) apart, from `first` (s after the first sample) on.

    Without `count` up to before the last sample. A signal that has that step already is not touched.
    """
    if first == 0.0 and has_step(even, step_time):
        return series_of(even.values[:count])
    if count is None:
        count = max(1, math.ceil(even.length / step_time - 1e-6))
    grid = (even.period, step_time, first)
    return StreamedSeries(
        count, lambda begin, behind: _filtered(even.values, *grid, begin, behind, _kernel())
    )


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
def _filtered(values, period, step_time, first, begin, behind, kernel):
    """Return the results `begin` .. `behind` - 1."""
    slower = max(period, step_time)
    reach = HALF_LENGTH * slower / period
    result = np.empty(behind - begin)
    for number in range(begin, behind):
        at = (first + number * step_time) / period
        total, weights = 0.0, 0.0
        for place in range(math.ceil(at - reach), math.floor(at + reach) + 1):
            distance = abs(at - place) * (period / slower) * _PHASES
            point = int(distance)
            weight = kernel[point] + (distance - point) * (kernel[point + 1] - kernel[point])
            total += weight * values[min(max(place, 0), values.size - 1)]
            weights += weight
        result[number - begin] = total / weights  # a constant comes out as it went in
    return result


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
