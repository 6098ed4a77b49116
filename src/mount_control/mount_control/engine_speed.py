"""The engine's speed as the vehicle sends it: which message a sample may use, and which are doubted.

Not a safety input: without it the law follows the engine's line in the displacement, as if it had never come.
So whatever is doubted is 0 Hz, which is not known, and never a reason for 0 A.
"""

from collections import deque
from math import pi

DELAY = 5_000_000
"""ns, chosen: so much older than a sample is what it uses, so that the order of arrival does not matter."""
HIGHEST = 150.0  # Hz, chosen: 9000 turns a minute
_FASTEST_CHANGE = 200.0  # Hz/s, chosen: an engine without load reaches 6000 turns a minute in half a second
_CHANGE_AT_ONCE = 2.0  # Hz, chosen: stamps are times of reception, some ms late now and then
_KEPT = 16  # messages, chosen: those of `DELAY` and more at 1 kHz
_PER_RADIAN = 1.0 / (2.0 * pi)


class EngineSpeed:
    """The newest messages of `engine_speed`; a stamp is that of the reception in the driver, ns."""

    def __init__(self) -> None:
        self.timeout = 100_000_000
        """ns: what is older than a sample by more is not used."""
        self.doubted = 0
        """Messages that were not used."""
        self.doubt = ''
        """Why the last one of them was not."""
        self.conflict = ''
        """Which other node publishes or may publish too; nothing is used meanwhile."""
        self._kept: deque[tuple[int, float]] = deque(maxlen=_KEPT)  # stamps rising, Hz; 0: doubted
        self._believed = 0, 0.0  # the last one that was used

    @property
    def last(self) -> int | None:
        """The newest stamp; None where none came."""
        return self._kept[-1][0] if self._kept else None

    def take(self, stamp: int, velocity: float, now: int | None) -> None:
        """Take a message (rad/s); `now` is the stamp of the newest displacement, None before the first."""
        if now is None:
            return
        kept = self._kept
        if kept and kept[-1][0] > now + self.timeout:
            kept.clear()  # the time of the displacement went back
            self._believed = stamp, 0.0
        if abs(stamp - now) > self.timeout:
            doubt = (
                f'its stamp lies {1e-9 * (stamp - now):+.3f} s from that of the displacement (limit '
                f'{1e-9 * self.timeout:g} s): stamp it with the time of its reception'
            )
        elif kept and stamp <= kept[-1][0]:
            doubt = 'its stamp does not rise: does another node publish it too?'
            kept[-1] = kept[-1][0], 0.0
        else:
            turns = velocity * _PER_RADIAN
            doubt = self._judge(stamp, turns)
            kept.append((stamp, 0.0 if doubt else turns))
        if doubt:
            self.doubted, self.doubt = self.doubted + 1, doubt

    def _judge(self, stamp: int, turns: float) -> str:
        """Return why so many turns (Hz) are not believed, '' where they are; remember those that are."""
        if not 0.0 <= turns <= HIGHEST:  # also NaN
            return (
                f'{60.0 * turns:.0f} turns a minute (limit 0 .. {60.0 * HIGHEST:g}): check '
                'engine_speed.signal of mount_driver and its DBC'
            )
        before, earlier = self._believed
        seconds = 1e-9 * (stamp - before)
        if min(earlier, turns) > 0.0:  # senders show the first turns of a start as 0
            limit = _CHANGE_AT_ONCE + _FASTEST_CHANGE * seconds
            if abs(turns - earlier) > limit:
                return (
                    f'a change by {60.0 * (turns - earlier):+.0f} turns a minute in {seconds:.3f} s (limit '
                    f'{60.0 * limit:.0f}): check its sender'
                )
        self._believed = stamp, turns
        return ''

    def at(self, stamp: int) -> float:
        """Return the Hz of the crankshaft that a displacement sample of `stamp` uses, 0.0 without any."""
        if self.conflict:
            return 0.0
        for taken, turns in reversed(self._kept):
            if taken <= stamp - DELAY:
                return turns if stamp - taken <= self.timeout else 0.0
        return 0.0

    def stopped(self, now: int | None) -> bool:
        """Whether messages came and do no more; `now` as for `take`."""
        return now is not None and bool(self._kept) and now - self._kept[-1][0] > self.timeout
