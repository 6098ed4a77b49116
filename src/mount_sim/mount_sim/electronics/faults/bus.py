"""Faults of the CAN bus: what of the frames of the electronics arrives, in which order and state."""

from collections import deque

from mount_driver.can_library import can
from mount_driver.codec import MountCodec
from mount_driver.frame import Frame
from mount_sim.electronics.faults.contract import Fault, Occasion
from mount_sim.random_numbers import RandomNumbers

Frames = list[can.Message]

_CODEC = MountCodec()
_EVERY = 3  # chosen: of so many samples one has damaged frames
_REORDERED = 10  # chosen: of so many samples one overtakes the one before
_REPLAYED = 100  # samples, chosen: age of the frames that are sent again
_BABBLED = 5  # frames in each sample, chosen: about what a bus of 500 kbit/s and 2 Mbit/s can carry besides
_LENGTH_LESS = 4  # bytes; CAN FD knows 24 and 20
_BUS_OFF = 0x40  # error class of a SocketCAN error frame, linux/can/error.h
_ERROR_BYTES = 8


class Silent(Fault):
    """No frame of the electronics is sent."""

    def on_bus(self, frames: Frames) -> Frames:
        return []


class BusOff(Silent):
    """The controller of the driver's end is bus off: its error frame comes first, then nothing either way.

    An error frame is local to a controller and no bus carries it. SocketCAN shows the controller's own to the
    driver; here the simulator gives it to the driver over a bus of this machine.
    """

    deaf = True

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._told = False

    def on_bus(self, frames: Frames) -> Frames:
        told, self._told = self._told, True
        if told:
            return []
        return [can.Message(arbitration_id=_BUS_OFF, is_error_frame=True, data=bytes(_ERROR_BYTES))]


class Deaf(Fault):
    """Setpoints are not received."""

    deaf = True


class Lost(Fault):
    """A share of the frames is lost, at random."""

    share = 0.0

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._random = RandomNumbers(occasion.seed)

    def on_bus(self, frames: Frames) -> Frames:
        kept = self._random.uniform(len(frames)) >= self.share
        return [frame for frame, keep in zip(frames, kept, strict=True) if keep]


class Lost1(Lost):
    """Of all frames 1 %."""

    share = 0.01


class Lost5(Lost):
    """Of all frames 5 %."""

    share = 0.05


class Lost50(Lost):
    """Of all frames 50 %."""

    share = 0.5


class Delayed(Fault):
    """Frames arrive some samples late; those under way when the fault ends are lost."""

    samples = 5

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._under_way: deque[Frames] = deque()

    def on_bus(self, frames: Frames) -> Frames:
        self._under_way.append([_copy(frame) for frame in frames])
        return self._under_way.popleft() if len(self._under_way) > self.samples else []


class DelayedLong(Delayed):
    """The same, later than the setpoint timeout."""

    samples = 50


class Duplicated(Fault):
    """Each frame arrives twice."""

    def on_bus(self, frames: Frames) -> Frames:
        return [frame for frame in frames for _ in range(2)]


class Reordered(Fault):
    """The frames of every tenth sample arrive behind those of the next."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._count = 0
        self._held: Frames = []

    def on_bus(self, frames: Frames) -> Frames:
        self._count += 1
        if self._count % _REORDERED == 0:
            self._held = [_copy(frame) for frame in frames]
            return []
        held, self._held = self._held, []
        return frames + held


class FrozenCounter(Fault):
    """All measurements carry the same alive counter, with a check sum that is right."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._alive = -1

    def on_bus(self, frames: Frames) -> Frames:
        for frame in frames:
            if frame.arbitration_id == _CODEC.measurement.frame_id:
                alive, measurement = _CODEC.decode_measurement(frame.data)
                if self._alive < 0:
                    self._alive = alive
                frame.data = _CODEC.encode_measurement(measurement, self._alive)
        return frames


class _Damaged(Fault):
    """The frames of every third sample are damaged on their way."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._count = 0

    def on_bus(self, frames: Frames) -> Frames:
        self._count += 1
        if self._count % _EVERY == 1:
            for frame in frames:
                self._damage(frame)
        return frames

    def _damage(self, frame: can.Message) -> None:
        raise NotImplementedError


class WrongCrc(_Damaged):
    """One byte is another."""

    def _damage(self, frame: can.Message) -> None:
        frame.data[-1] ^= 0xFF


class WrongLength(_Damaged):
    """The last bytes are missing."""

    def _damage(self, frame: can.Message) -> None:
        frame.data = frame.data[:-_LENGTH_LESS]
        frame.dlc = len(frame.data)


class Replayed(Fault):
    """Behind each frame comes one of 100 samples ago once more, as it was."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._past: deque[Frames] = deque()

    def on_bus(self, frames: Frames) -> Frames:
        self._past.append([_copy(frame) for frame in frames])
        return frames + self._past.popleft() if len(self._past) > _REPLAYED else frames


class Babbling(Fault):
    """Another node sends frames with identifiers that are none of this mount's, without a pause."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._random = RandomNumbers(occasion.seed)
        own = {_CODEC.measurement.frame_id, _CODEC.setpoint.frame_id, _CODEC.status.frame_id}
        self._identifiers = [number for number in range(0x800) if number not in own]

    def on_bus(self, frames: Frames) -> Frames:
        chosen = self._random.uniform(_BABBLED)
        foreign: Frames = [
            Frame(self._identifiers[int(number * len(self._identifiers))], number.tobytes())
            for number in chosen
        ]
        return frames + foreign


def _copy(frame: can.Message) -> can.Message:
    """Return the frame as it is now, which no later change of the given one changes."""
    return Frame(frame.arbitration_id, bytearray(frame.data))
