"""The receiving side of the end-to-end protection: every frame is judged and counted."""

from collections.abc import Callable
from enum import IntEnum
from typing import Generic, TypeVar

from mount_driver.codec import OutOfRangeError, WrongCrcError, WrongLengthError, alive_counter_of

M = TypeVar('M')


class Outcome(IntEnum):
    """What became of a frame."""

    OK = 0  # the next one
    REPEATED = 1  # the same alive counter as the last one
    LOST = 2  # good, but frames before it are missing: see `E2EReceiver.lost`
    LATE = 3  # good, but older than the last one
    WRONG_CRC = 4
    WRONG_LENGTH = 5
    OUT_OF_RANGE = 6  # protected and complete, but its content is not allowed


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

    def __init__(self, decode: Callable[[bytes | bytearray], M]):
        self.outcome = Outcome.OK
        """Of the last frame."""
        self.counts = [0] * len(Outcome)
        """Frames by `Outcome`."""
        self.lost = 0
        """Frames missing so far."""
        self._decode = decode
        self._last = -1
        self._late = -1

    def receive(self, data: bytes | bytearray) -> M | None:
        """Return the message of a frame, or None where its CRC, length or content is wrong; see `outcome`."""
        try:
            message = self._decode(data)
        except WrongCrcError:
            outcome, message = Outcome.WRONG_CRC, None
        except WrongLengthError:
            outcome, message = Outcome.WRONG_LENGTH, None
        except OutOfRangeError:
            outcome, message = Outcome.OUT_OF_RANGE, None
            self._follow(alive_counter_of(data))
        else:
            outcome = self._follow(alive_counter_of(data))
        self.outcome = outcome
        self.counts[outcome] += 1
        return message

    @property
    def corrupt(self) -> int:
        """Frames that were not used because of their CRC, length or content."""
        return sum(self.counts[Outcome.WRONG_CRC :])

    def _follow(self, alive: int) -> Outcome:
        last = self._last
        step = (alive - last) & 0xFF
        if last < 0 or step == 1:
            self._last = alive
            return Outcome.OK
        if step == 0:
            return Outcome.REPEATED
        if step < 128:
            self._last = alive
            self.lost += step - 1
            return Outcome.LOST
        # A late frame does not set the count back; two in a row in order are a sender that began anew.
        if self._late >= 0 and alive == (self._late + 1) & 0xFF:
            self._last, self._late = alive, -1
        else:
            self._late = alive
        return Outcome.LATE
