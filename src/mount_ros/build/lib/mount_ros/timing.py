"""Latency statistics in fixed memory, cheap enough for every message at 1 kHz."""

import math

import numpy as np

_BINS_PER_DECADE = 200  # chosen: 1.2 % wide bins
_LOWEST = 1e-6  # s
_DECADES = 7


class LatencyHistogram:
    """Counts durations in logarithmic bins from 1 us to 10 s."""

    def __init__(self) -> None:
        self.count = 0
        self.highest = math.nan
        self._bins = [0] * (_BINS_PER_DECADE * _DECADES + 1)

    def add(self, seconds: float) -> None:
        """Count one duration in s."""
        self.count += 1
        if not seconds <= self.highest:
            self.highest = seconds
        place = int(_BINS_PER_DECADE * math.log10(seconds / _LOWEST)) if seconds > _LOWEST else 0
        self._bins[min(place, len(self._bins) - 1)] += 1

    def quantile(self, share: float) -> float:
        """Return the duration in s below which `share` (0..1) of those counted lie; NaN if none was."""
        if self.count == 0:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._bins), share * self.count))
        return min(_LOWEST * 10 ** ((place + 0.5) / _BINS_PER_DECADE), self.highest)
