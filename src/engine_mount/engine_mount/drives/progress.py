"""How far a drive through the graph has come, between what its simulator tells once a second."""

import time
from collections.abc import Callable, Mapping

_LONGEST = 1.5  # s, chosen: beyond what the simulator told last, for it tells once a second


class DriveProgress:
    """The share of a drive that is done: 0 at `figures`, 1 at the last sample.

    In `real_time` the samples go on by the clock until the simulator tells again.
    """

    def __init__(
        self, figures: Mapping[str, str], *, real_time: bool, clock: Callable[[], float] = time.monotonic
    ):
        self._first = _samples(figures)
        self._real_time = real_time
        self._clock = clock
        self._last, self._told = self._first, clock()

    def share(self, figures: Mapping[str, str]) -> float:
        """Return the share by what the simulator has told last."""
        samples, now = _samples(figures), self._clock()
        if samples != self._last:
            self._last, self._told = samples, now
        if self._real_time and samples:
            rate = samples / float(figures.get('simulated_s', 'nan'))
            samples += round(rate * min(now - self._told, _LONGEST)) if rate == rate else 0
        whole = int(figures.get('samples_of_run', 1)) - self._first
        return min(1.0, max(0.0, (samples - self._first) / whole)) if whole > 0 else 1.0


def _samples(figures: Mapping[str, str]) -> int:
    return int(figures.get('samples', 0))
