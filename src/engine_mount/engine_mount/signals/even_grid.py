"""A recorded signal as evenly spaced samples, whatever its stamps look like.

A sensor samples by its own clock; its stamps often come later, from a logger that is late, coarse or works in
bursts. So stamps are taken, in this order, as

1. exact, where they lie on a straight line over the number of the sample: nothing is changed;
2. wrong, where some are nearer to each other than a sensor samples, or where evenly spaced samples foretell
   each other at least as well: then the spacing is even, and the line gives its times. No sample may be
   missing or too many: the stamps behind it would be shifted against the line;
3. true, else: samples that coincide count as one, with their mean, and local cubics lead to the grid.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.local_cubic import interpolated, prediction_error
from engine_mount.signals.signal import SECOND, FloatArray, Signal, SignalError, check_count
from mount_models.arithmetic.compiled import compiled

ON_THE_LINE = 1e-3
"""Share of a period, chosen: so late a sample of a sine of 0.15 of the rate is wrong by a thousandth."""
CROWDED = 0.25
"""Share of the mean period, chosen: no sensor with a clock of its own samples again so soon."""
LONGEST_BURST = 0.25
"""s, chosen: stamps of one burst may be so far from the line."""
_SLOW_CLOCK = 0.005  # chosen: so much slower than its name may a sensor of just the lowest rate be
_AS_GOOD = 1.1  # chosen: even spacing is taken unless stamps foretell the samples better by more than that
_FARTHEST_BACK = 2.0  # mean periods, chosen: so late a sample may come in the file
_BLOCK = 1 << 18  # samples looked at together, chosen
_OFTEN = 0.1  # share of steps, chosen: what is more frequent is a habit of the logger, or of the file


@dataclass(frozen=True, eq=False)
class EvenSignal:
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
    """Return the signal on an even grid; raises `SignalError`.

    Refused are time that goes back, gaps of more than `longest_gap` (s), a rate below `lowest_rate` (Hz).
    """
    _refuse_time_that_goes_back(signal)
    kept = _once(signal)
    stamps, values = (
        (signal.times, signal.values) if kept.all() else (signal.times[kept], signal.values[kept])
    )
    if bool(np.all(stamps[1:] > stamps[:-1])):  # as most are: no copies of what can be an hour
        first, period = _line(stamps)
        if _latest(stamps, first, period) <= ON_THE_LINE * period:
            return _checked(signal, first, period, values, lowest_rate, ())
    order = np.argsort(stamps, kind='stable')
    rising = stamps[order]
    first, period = _line(rising)
    late = rising - (first + period * np.arange(rising.size))
    if np.abs(late).max() <= ON_THE_LINE * period:
        return _checked(signal, first, period, values[order], lowest_rate, ())
    gap = np.diff(rising).max() > longest_gap and not _in_bursts(rising)
    if not gap and _is_level(late, period) and _is_even(rising, values, order, late, period):
        note = (
            f'taken as evenly spaced at {1.0 / period:.4g} Hz: the stamps are up to '
            f'{1e3 * np.abs(late).max():.3g} ms off a line through them'
        )
        return _checked(signal, first, period, values, lowest_rate, (note,))
    return _by_stamps(signal, rising, values[order], longest_gap, lowest_rate)


def gaps(signal: Signal, longest_gap: float) -> NDArray[np.intp]:
    """Return behind which samples of `signal` no next one comes for more than `longest_gap` (s).

    Pauses between the bursts of a logger are none, as `evenly_spaced` sees them. Raises `SignalError` for
    time that goes back.
    """
    _refuse_time_that_goes_back(signal)
    certain = _steps_where(signal.times, lambda steps: steps > max(longest_gap, LONGEST_BURST))
    edges = np.concatenate([[0], certain + 1, [signal.times.size]])
    found = [certain]
    for first, behind in pairwise(edges.tolist()):
        places = first + _steps_where(signal.times[first:behind], lambda steps: steps > longest_gap)
        if places.size and not _in_bursts(np.sort(signal.times[first:behind])):
            found.append(places)
    return np.sort(np.concatenate(found))


def _refuse_time_that_goes_back(signal: Signal) -> None:
    times = signal.times
    mean = (times.max() - times.min()) / (times.size - 1)
    bad = _steps_where(times, lambda steps: steps < -_FARTHEST_BACK * mean)
    backwards = _steps_where(times, lambda steps: steps < 0.0)
    if backwards.size > _OFTEN * (times.size - 1) or mean == 0.0:
        bad = _steps_where(times, lambda steps: steps <= 0.0)
    if bad.size:
        place = int(bad[0])
        raise SignalError(
            f'{signal.name}: time does not rise at sample {place + 1}: {times[place]:.6f} s is followed by '
            f'{times[place + 1]:.6f} s; sort the samples or remove the repeated ones'
        )


def _steps_where(times: FloatArray, wanted: Callable[[FloatArray], NDArray[np.bool_]]) -> NDArray[np.intp]:
    """Return behind which samples a step is as `wanted`, in blocks: all steps of an hour are not held."""
    firsts = range(0, max(times.size - 1, 0), _BLOCK)
    found = [first + np.flatnonzero(wanted(np.diff(times[first : first + _BLOCK + 1]))) for first in firsts]
    return np.concatenate([np.zeros(0, np.intp), *found])


def _once(signal: Signal) -> NDArray[np.bool_]:
    """Return which samples to keep: once those that stand twice, if without the copies no stamps crowd."""
    times, values = signal.times, signal.values
    again = np.concatenate([[False], (times[1:] == times[:-1]) & (values[1:] == values[:-1])])
    if again.any() and again.sum() < again.size - 2 and not _crowd(np.sort(signal.times[~again])).any():
        return ~again
    return np.ones(again.size, bool)


def _crowd(rising: FloatArray) -> NDArray[np.bool_]:
    """Return which steps between stamps are shorter than a sensor's."""
    return np.asarray(np.diff(rising) < CROWDED * (rising[-1] - rising[0]) / (rising.size - 1))


def _in_bursts(rising: FloatArray) -> bool:
    """Whether pauses between stamps are those between bursts rather than gaps."""
    return bool(np.mean(_crowd(rising)) > _OFTEN)


@compiled
def _line(stamps: FloatArray) -> tuple[float, float]:
    """Return the first time and the period of the straight line through stamps over their numbers."""
    middle = 0.5 * (stamps.size - 1)
    mean, slope, weight = 0.0, 0.0, 0.0
    for number in range(stamps.size):
        mean += stamps[number]
        slope += (number - middle) * stamps[number]
        weight += (number - middle) ** 2
    return mean / stamps.size - middle * slope / weight, slope / weight


@compiled
def _latest(rising: FloatArray, first: float, period: float) -> float:
    """Return by how much stamps are off the line at most."""
    most = 0.0
    for number in range(rising.size):
        most = max(most, abs(rising[number] - (first + period * number)))
    return most


def _is_level(late: FloatArray, period: float) -> bool:
    """Whether stamps stay about the line, `late` (n,) in s: a lost or doubled sample would shift the rest."""
    if np.abs(late).max() > LONGEST_BURST:
        return False
    width = min(max(math.ceil(2.0 * LONGEST_BURST / period), 20), late.size)
    begins = range(0, late.size - width + 1, max(width // 2, 1))
    windows = [late[begin : begin + width] for begin in begins]
    level = np.array([np.median(window) for window in windows])
    spread = float(np.median([np.subtract(*np.percentile(window, [90, 10])) for window in windows]))
    shifts = np.abs(level[2:] - level[:-2])
    return bool(
        np.abs(level).max() <= max(period, spread) and shifts.max(initial=0.0) <= 0.5 * max(period, spread)
    )


def _is_even(
    rising: FloatArray, values: FloatArray, order: NDArray[np.intp], late: FloatArray, period: float
) -> bool:
    """Whether samples `values` in the order of the file were taken evenly rather than when stamps say."""
    if _crowd(rising).any():
        return True
    off = np.abs(late) > 10.0 * ON_THE_LINE * period
    if not off.any():
        return True
    by_number = prediction_error(np.arange(rising.size, dtype=float), values, off)
    by_stamp = prediction_error(rising, values[order], off)
    return bool(by_number <= _AS_GOOD * _AS_GOOD * by_stamp)


def _by_stamps(
    signal: Signal, rising: FloatArray, values: FloatArray, longest_gap: float, lowest_rate: float
) -> EvenSignal:
    mean_period = (rising[-1] - rising[0]) / (rising.size - 1)
    times, distinct = _merged(rising, values, CROWDED * mean_period)
    check_count(signal.name, times.size)
    steps = np.diff(times)
    count = int(np.rint(steps / np.median(steps)).sum())
    period = (times[-1] - times[0]) / count
    notes = []
    if times.size < rising.size:
        notes.append(
            f'{rising.size - times.size} samples within {1e3 * CROWDED * mean_period:.3g} ms of the one '
            'before are averaged with it'
        )
    if steps.max() > 1.5 * period:
        place = int(steps.argmax())
        notes.append(
            f'{np.count_nonzero(steps > 1.5 * period)} gaps are interpolated, the longest of '
            f'{1e3 * steps[place]:.3g} ms at {times[place]:.3f} s'
        )
    grid = times[0] + period * np.arange(count + 1)
    even = _checked(signal, times[0], period, interpolated(times, distinct, grid), lowest_rate, tuple(notes))
    if steps.max() > longest_gap:
        place = int(steps.argmax())
        raise SignalError(
            f'{signal.name} has a gap of {steps.max():.3f} s at {times[place]:.3f} s; '
            f'up to {longest_gap:.3g} s are interpolated: cut the recording there'
        )
    return even


@compiled
def _merged(times: FloatArray, values: FloatArray, distance: float) -> tuple[FloatArray, FloatArray]:
    """Return times and values with those averaged that follow the first of their group within `distance`."""
    merged_times, merged_values = np.empty_like(times), np.empty_like(values)
    groups, place = 0, 0
    while place < times.size:
        end, time, value = place, 0.0, 0.0
        while end < times.size and (end == place or times[end] - times[place] < distance):
            time += times[end] - times[place]
            value += values[end]
            end += 1
        merged_times[groups] = times[place] + time / (end - place)
        merged_values[groups] = value / (end - place)
        groups += 1
        place = end
    return merged_times[:groups], merged_values[:groups]


def _checked(
    signal: Signal,
    first: float,
    period: float,
    values: FloatArray,
    lowest_rate: float,
    notes: tuple[str, ...],
) -> EvenSignal:
    if 1.0 / period < (1.0 - _SLOW_CLOCK) * lowest_rate:
        raise SignalError(
            f'{signal.name} has {1.0 / period:.4g} samples per second (is its time in seconds?); '
            f'at least {lowest_rate:g} are needed' + ''.join(f'; {note}' for note in notes)
        )
    begin = signal.begin + round(SECOND * first)
    return EvenSignal(signal.name, period, values, begin, (*signal.notes, *notes))
