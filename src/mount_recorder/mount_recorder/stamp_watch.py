"""The stamps of a topic with a fixed rate, watched while its samples arrive."""

from mount_ros.messages.scalars import stamp_of

FARTHEST = 10_000_000_000
"""ns, chosen: a stamp farther from the samples that came around it is misdated."""
LONGEST_PAUSE = 3_600_000_000_000
"""ns, chosen: of the parts of a recording that are farther apart, all but the longest are misdated."""


class StampWatch:
    """Counts what `stamp_statistics` does while the samples of a regular clock arrive, one by one."""

    def __init__(self, rate: float):
        self.present = 0
        self.lost = 0
        self.duplicated = 0
        self.out_of_order = 0
        self.misdated = 0
        self.last_stamp = 0  # ns, the latest so far
        self._doubtful: int | None = None  # a stamp far off, until the next tells what it was
        self._period = 1e9 / rate

    def observe(self, raw: bytes) -> None:
        """Count a serialised sample."""
        self.add(stamp_of(raw))

    def add(self, stamp: int) -> None:
        """Count the sample of time `stamp` (ns)."""
        self.present += 1
        if self.present == 1:
            self.last_stamp = stamp
            return
        if abs(stamp - self.last_stamp) > FARTHEST and not self._goes_on(stamp):
            return
        self._doubtful = None
        steps = round((stamp - self.last_stamp) / self._period)
        if steps > 0:
            self.lost += steps - 1
            self.last_stamp = stamp
        elif steps == 0:
            self.duplicated += 1
        else:
            self._add_late()

    def _goes_on(self, stamp: int) -> bool:
        """Return whether a stamp far off is the second of two that agree; else it counts as misdated."""
        first, self._doubtful = self._doubtful, stamp
        if first is None or abs(stamp - first) > FARTHEST:
            self.misdated += 1
            return False
        if 0 < first - self.last_stamp < LONGEST_PAUSE:  # else of another clock
            self.misdated -= 1
            self.lost += round((first - self.last_stamp) / self._period) - 1
        self.last_stamp = first
        return True

    def _add_late(self) -> None:
        # A late sample fills a gap that was counted before; without a gap it repeats a sample.
        self.out_of_order += 1
        if self.lost:
            self.lost -= 1
        else:
            self.duplicated += 1
