"""What a signal is in bands of frequency: filtered piece by piece, so that its length costs no memory."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from mount_bags.messages.compact_times import CompactTimes
from mount_replay.fleet.catalogue.band_pass import BandPass, FloatArray

_PIECE = 1 << 18  # samples, chosen


class InBand(NamedTuple):
    """Largest absolute value and rms of a signal in one band, in its unit."""

    peak: float
    rms: float


def in_bands(
    stamps: CompactTimes, values: FloatArray, rate: float, bands: Sequence[tuple[float, float]]
) -> list[InBand]:
    """Return peak and rms of a signal (n,) in each band (Hz), NaN where it is too short for one.

    The stamps (ns) rise. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    known = np.isfinite(values)
    ends = np.array([0, np.argmax(known), len(known) - 1 - np.argmax(known[::-1])])
    times = stamps.at(ends)
    first, last = ((times[1:] - times[0]) * 1e-9).tolist()
    count = math.floor((last - first) * rate + 0.5) + 1 if last > first else 0
    passes = [_Pass(band, rate) if count >= rate / band[0] else None for band in bands]
    if any(passes):
        for moved in _evenly(_samples(stamps, values), first, rate, count):
            for each in passes:
                if each is not None:
                    each.take(moved - values[ends[1]])
    # less than one period of its lowest frequency is too short
    return [InBand(math.nan, math.nan) if each is None else each.found(count) for each in passes]


class _Pass:
    """What came through the filter of a band."""

    def __init__(self, band: tuple[float, float], rate: float):
        self._filter, self._peak, self._square = BandPass(band, rate), 0.0, 0.0

    def take(self, values: FloatArray) -> None:
        passed = self._filter.passed(values)
        self._peak = max(self._peak, float(np.abs(passed).max()))
        self._square += float(np.sum(passed**2))

    def found(self, count: int) -> InBand:
        return InBand(self._peak, math.sqrt(self._square / count))


def _samples(stamps: CompactTimes, values: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield times (s from the first stamp) and values of the samples that are known."""
    begin, zero = 0, stamps.block(0)[0]
    for block in stamps.blocks():
        piece = values[begin : begin + len(block)]
        begin += len(block)
        known = np.isfinite(piece)
        yield ((block - zero) * 1e-9)[known], piece[known]


def _evenly(
    samples: Iterator[tuple[FloatArray, FloatArray]], first: float, rate: float, count: int
) -> Iterator[FloatArray]:
    """Yield `count` values at even steps from the time `first` (s) on."""
    time, values = np.empty(0), np.empty(0)
    for begin in range(0, count, _PIECE):
        grid = first + np.arange(begin, min(begin + _PIECE, count)) / rate
        behind = max(int(np.searchsorted(time, grid[0], side='right')) - 1, 0)
        times, pieces = [time[behind:]], [values[behind:]]
        while not (times[-1].size and times[-1][-1] > grid[-1]) and (found := next(samples, None)):
            times.append(found[0])
            pieces.append(found[1])
        time, values = np.concatenate(times), np.concatenate(pieces)
        yield np.interp(grid, time, values)
