"""A recorded signal as evenly spaced samples.

A sensor samples by its own clock, and a logger stamps the samples a little late: stamps within `JITTER` of a
straight line over the number of the sample change nothing, and the line gives the times. Other stamps are
true: cubics through four neighbours lead to an even grid, over gaps up to a limit. Stamps that crowd, as of
samples that came in bursts, are refused, for no number tells when these were taken; a stated rate does.
"""

from typing import NamedTuple

import numpy as np

from engine_mount.signals.signal import (
    SECOND,
    FloatArray,
    Signal,
    SignalError,
    check_count,
    check_order,
    mean,
)
from mount_models.arithmetic.compiled import compiled

ON_THE_LINE = 1e-3
"""Share of a period, chosen: so late a sample of a sine of 0.15 of the rate is wrong by a thousandth."""
JITTER = 0.4
"""Share of a period, chosen: a lost sample shifts others by 0.5 at least against the line."""
CROWDED = 0.25
"""Share of a period, chosen: no sensor with a clock of its own samples again so soon."""
_SLOW_CLOCK = 0.005  # chosen: so much slower than its name may a sensor of just the lowest rate be


class EvenSignal(NamedTuple):
    """Values (n,) `period` s apart from `begin` (ns) on; `notes` say what was done to get them."""

    name: str
    period: float
    values: FloatArray
    begin: int
    notes: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Samples per second."""
        return 1.0 / self.period

    @property
    def length(self) -> float:
        """Time from the first to the last sample, s."""
        return (len(self.values) - 1) * self.period


def evenly_spaced(signal: Signal, longest_gap: float, lowest_rate: float) -> EvenSignal:
    """Return the signal on an even grid, samples that stand twice once; raises `SignalError`.

    Refused are time that goes back, gaps of more than `longest_gap` (s), stamps that crowd, and a rate below
    `lowest_rate` (Hz).
    """
    name = signal.name
    check_order(name, signal.times, 'say their --rate')
    if signal.times[-1] == signal.times[0]:
        raise SignalError(
            f'{name}: time does not rise: all samples are at {signal.times[0]:g} s; say their --rate'
        )
    once = np.append(True, (np.diff(signal.times) != 0.0) | (np.diff(signal.values) != 0.0))
    times, values = signal.times[once], signal.values[once]
    check_count(name, times.size)
    numbers = np.arange(times.size) - 0.5 * (times.size - 1)
    period = mean(numbers * times) / mean(numbers * numbers)
    first = mean(times) + numbers[0] * period
    late = float(np.abs(times - (first + period * np.arange(times.size))).max()) / period
    notes = list(signal.notes)
    if late > JITTER:
        first, period, values, done = _by_stamps(name, times, values, period, longest_gap)
        notes.append(done)
    elif late > ON_THE_LINE:
        notes.append(
            f'taken as evenly spaced at {1.0 / period:.4g} Hz: the stamps are up to '
            f'{1e3 * late * period:.3g} ms off a line through them'
        )
    if 1.0 / period < (1.0 - _SLOW_CLOCK) * lowest_rate:
        raise SignalError(
            f'{name} has {1.0 / period:.4g} samples per second (is its time in seconds?); at least '
            f'{lowest_rate:g} are needed'
        )
    return EvenSignal(name, period, values, signal.begin + round(SECOND * first), tuple(notes))


def _by_stamps(
    name: str, times: FloatArray, values: FloatArray, period: float, longest_gap: float
) -> tuple[float, float, FloatArray, str]:
    """Return the first time, the period and the values of an even grid, and what was done.

    Raises `SignalError` for gaps of more than `longest_gap` (s), and stamps that crowd.
    """
    steps = np.diff(times)
    longest, shortest = int(steps.argmax()), int(steps.argmin())
    if steps[longest] > longest_gap:
        raise SignalError(
            f'{name} has a gap of {steps[longest]:.3f} s at {times[longest]:.3f} s; up to '
            f'{longest_gap:.3g} s are interpolated: cut the recording there, or say its --rate if the '
            'samples were taken evenly'
        )
    if steps[shortest] < CROWDED * period:
        raise SignalError(
            f'{name}: samples {shortest} and {shortest + 1} are {1e3 * steps[shortest]:.3g} ms apart at '
            f'{times[shortest]:.3f} s, less than {1e3 * CROWDED * period:.3g} ms: say their --rate if they '
            'were taken evenly, or remove one'
        )
    count = int(np.rint(steps / np.median(steps)).sum())
    period = float(times[-1] - times[0]) / count
    wide = np.count_nonzero(steps > 1.5 * period)
    note = f'brought from uneven stamps onto an even grid of {1.0 / period:.4g} Hz'
    if wide:
        note = (
            f'{wide} gaps are interpolated, the longest of {1e3 * steps[longest]:.3g} ms at '
            f'{times[longest]:.3f} s'
        )
    grid = times[0] + period * np.arange(count + 1)
    return float(times[0]), period, interpolated(times, values, grid), note


@compiled
def interpolated(places: FloatArray, values: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the values at `grid` (m,), rising, by Lagrange's cubics through four neighbours.

    `places` (n,), n >= 4, rise strictly. Results leave the range of their four samples by no more than half
    of it: a cubic through close samples on either side of a gap would else throw itself far out. The error of
    a sine of frequency f at even distances T is below 0.024 (2 pi f T)^4 of its amplitude.
    """
    result = np.empty(grid.size)
    right = 1
    for number in range(grid.size):
        while right < places.size - 1 and places[right] < grid[number]:
            right += 1
        first = min(max(right - 2, 0), places.size - 4)
        near = values[first : first + 4]
        cubic = 0.0
        for one in range(4):
            weight = 1.0
            for other in range(4):
                if other != one:
                    weight *= (grid[number] - places[first + other]) / (
                        places[first + one] - places[first + other]
                    )
            cubic += weight * near[one]
        low, high = near.min(), near.max()
        result[number] = min(max(cubic, low - 0.5 * (high - low)), high + 0.5 * (high - low))
    return result
