"""What a signal is in bands of frequency: filtered piece by piece, so that its length costs no memory."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from engine_mount.recordings.messages.compact_times import CompactTimes
from engine_mount.recordings.messages.packed_column import PackedColumn
from mount_replay.fleet.catalogue.band_pass import BandPass, FloatArray

_PIECE = 1 << 18  # samples, chosen


class InBand(NamedTuple):
    """Largest absolute value and rms of a signal in one band, in its unit."""

    peak: float
    rms: float


def in_bands(
    stamps: CompactTimes, values: PackedColumn, rate: float, bands: Sequence[tuple[float, float]]
) -> list[InBand]:
    """Return peak and rms of a signal (n,) in each band (Hz), NaN where it is too short for one.

    The stamps (ns) rise. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    first, last, zero = _ends(stamps, values)
    count = math.floor((last - first) * rate + 0.5) + 1 if last > first else 0
    passes = [_Pass(band, rate) if count >= rate / band[0] else None for band in bands]
    if any(passes):
        for moved in _evenly(_samples(stamps, values), first, rate, count):
            for each in passes:
                if each is not None:
                    each.take(moved - zero)
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


def _ends(stamps: CompactTimes, values: PackedColumn) -> tuple[float, float, float]:
    """Return when the first and the last known sample are (s from the first stamp), and the first one."""
    first = last = zero = math.nan
    for times, known in _samples(stamps, values):
        if len(known):
            if math.isnan(first):
                first, zero = float(times[0]), float(known[0])
            last = float(times[-1])
    return first, last, zero


def _samples(stamps: CompactTimes, values: PackedColumn) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield times (s from the first stamp) and values of the samples that are known."""
    zero = stamps.block(0)[0]
    for block, piece in zip(stamps.blocks(), values.blocks(), strict=True):
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
