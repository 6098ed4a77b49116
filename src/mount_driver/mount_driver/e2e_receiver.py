"""The receiving side of the end-to-end protection: each frame is judged and counted, a doubtful one not used.

AUTOSAR E2E profile 5 as the DBC describes it; both ends of the bus run this code.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Generic, TypeVar

from mount_driver.codec import WrongCrcError, WrongLengthError
from mount_driver.layout import MessageLayout

M = TypeVar('M')

_LOOK_BACK = 16  # frames, chosen: a sequence that goes on so soon after it was left still has its sender


class Outcome(IntEnum):
    """What became of a frame: the first two are used, those from `REPEATED` on have failed a check."""

    OK = 0  # the next one
    LOST = 1  # in order, but frames before it are missing: see `E2EReceiver.lost`
    SYNCHRONISING = 2  # in order, but too soon after a wrong sequence or the start to be believed
    REPEATED = 3  # the same alive counter as the last one
    WRONG_SEQUENCE = 4  # its counter went back, or farther ahead than frames may be missing
    WRONG_CRC = 5
    WRONG_LENGTH = 6
    OUT_OF_RANGE = 7  # protected and complete, but its content is not allowed


class AliveCounter:
    """The sender's 8 bit counter: one for each message."""

    def __init__(self) -> None:
        self._next = 0

    def next(self) -> int:
        """Return the counter of the frame to be sent, 0..255."""
        counter = self._next
        self._next = (counter + 1) & 0xFF
        return counter


class E2EReceiver(Generic[M]):
    """Decodes the frames of one message, judges their order by the alive counter and counts outcomes."""

    def __init__(self, decode: Callable[[bytes | bytearray], tuple[int, M | None]], layout: MessageLayout):
        self.outcome = Outcome.OK
        """Of the last frame."""
        self.counts = [0] * len(Outcome)
        """Frames by `Outcome`."""
        self.lost = 0
        """Frames missing so far."""
        self.strangers = 0
        """Sound frames that one sender alone cannot have sent.

        They carry another content under the counter of the last one, or go on with a sequence that was left
        for another a few frames before. Losses and a restart of the sender do neither.
        """
        self._decode = decode
        self._longest_step = layout.max_delta_counter
        self._sync_frames = layout.sync_frames
        self._last = -1  # alive counter of the last frame whose CRC was good; none yet
        self._awaited = 0  # frames in order that must still come before one is used
        self._last_data: bytes | bytearray = b''
        self._left: list[tuple[int, int]] = []  # last counters of sequences that were left, and when

    def receive(self, data: bytes | bytearray) -> M | None:
        """Return the message of a frame, or None where it must not be used; see `outcome`."""
        message = None
        try:
            alive, message = self._decode(data)
        except WrongCrcError:
            outcome = Outcome.WRONG_CRC
        except WrongLengthError:
            outcome = Outcome.WRONG_LENGTH
        else:
            outcome = self._follow(alive, data)
            if message is None:
                outcome = Outcome.OUT_OF_RANGE
        self.outcome = outcome
        self.counts[outcome] += 1
        return message if outcome <= Outcome.LOST else None

    @property
    def corrupt(self) -> int:
        """Frames that were not used because of their CRC, length or content."""
        return sum(self.counts[Outcome.WRONG_CRC :])

    @property
    def failed(self) -> int:
        """Frames that failed a check: the corrupt, the repeated and those of wrong sequence."""
        return sum(self.counts[Outcome.REPEATED :])

    def _follow(self, alive: int, data: bytes | bytearray) -> Outcome:
        last, self._last = self._last, alive
        last_data, self._last_data = self._last_data, data
        step = (alive - last) & 0xFF if last >= 0 else alive + 1  # a receiver that starts counts on from 255
        if step == 0:
            self.strangers += data != last_data
            return Outcome.REPEATED
        if step > self._longest_step:
            self._awaited = self._sync_frames
            if last < 0:
                return Outcome.SYNCHRONISING
            self._leave(last, alive)
            return Outcome.WRONG_SEQUENCE
        self.lost += step - 1
        if self._awaited > 0:
            self._awaited -= 1
            if self._awaited > 0:
                return Outcome.SYNCHRONISING
        return Outcome.OK if step == 1 else Outcome.LOST

    def _leave(self, last: int, alive: int) -> None:
        """Note that `alive` does not follow `last`; it may go on with a sequence that was left before."""
        frames = sum(self.counts)
        self._left = [(counter, at) for counter, at in self._left if frames - at < _LOOK_BACK]
        if any(1 <= (alive - counter) & 0xFF <= self._longest_step for counter, _ in self._left):
            self.strangers += 1
        self._left.append((last, frames))
