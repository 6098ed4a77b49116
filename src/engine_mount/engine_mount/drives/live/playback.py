"""Where a live replay stands: which messages are due, with pause, step and seek; it knows no clock."""

import numpy as np
from numpy.typing import NDArray


class Playback:
    """Position over wall time; times of messages in s from the beginning, rising.

    Every method takes `now`, the wall time in s. `samples` are the times to which `step` goes.
    """

    def __init__(
        self, times: NDArray[np.float64], samples: NDArray[np.float64], rate: float, begin: float = 0.0
    ):
        self._times = times
        self._samples = samples
        self._rate = rate
        self._anchor = (begin, 0.0)  # position s, wall time s
        self.paused = True
        self.next = int(np.searchsorted(times, begin))

    @property
    def length(self) -> float:
        """Time of the last message, s."""
        return float(self._times[-1])

    @property
    def finished(self) -> bool:
        """Whether every message was given out."""
        return self.next >= len(self._times)

    def position(self, now: float) -> float:
        """Return the position, s."""
        position, wall = self._anchor
        return min(position if self.paused else position + self._rate * (now - wall), self.length)

    def play(self, now: float) -> None:
        """Go on from the present position."""
        self._anchor = (self.position(now), now)
        self.paused = False

    def pause(self, now: float) -> None:
        """Stay at the present position."""
        self._anchor = (self.position(now), now)
        self.paused = True

    def seek(self, now: float, distance: float) -> None:
        """Go forth (or back, below 0) by `distance` s."""
        position = min(max(self.position(now) + distance, 0.0), self.length)
        self._anchor = (position, now)
        self.next = int(np.searchsorted(self._times, position))

    def step(self, now: float) -> None:
        """Pause at the next sample."""
        self.pause(now)
        place = int(np.searchsorted(self._samples, self._anchor[0], side='right'))
        if place < len(self._samples):
            self._anchor = (float(self._samples[place]), now)

    def due(self, now: float) -> range:
        """Return the numbers of the messages up to the present position that were not given out."""
        end = int(np.searchsorted(self._times, self.position(now), side='right'))
        numbers = range(self.next, max(self.next, end))
        self.next = numbers.stop
        return numbers

    def until_next(self, now: float) -> float:
        """Return how long (s) until a message is due; infinite while paused or finished."""
        if self.paused or self.finished:
            return float('inf')
        return max(0.0, (float(self._times[self.next]) - self.position(now)) / self._rate)
