"""Faults of the CAN bus and of the electronics' counters: which frames arrive, in which order and state."""

from collections.abc import Callable

from mount_driver.bus import Frame
from mount_driver.can_library import can
from mount_driver.protocol import MountCodec
from mount_sim.electronics.faults.fault import Fault, Frames

_CODEC = MountCodec()
_EVERY = 3  # chosen: of so many samples one has damaged frames
_REORDERED = 10  # chosen: of so many samples one overtakes the one before
_REPLAYED = 100  # samples, chosen: age of the frames that are sent again
_BABBLED = 5  # frames in each sample, chosen: about what a bus of 500 kbit/s and 2 Mbit/s can carry besides
_OWN = {_CODEC.measurement.frame_id, _CODEC.setpoint.frame_id, _CODEC.status.frame_id}
_FOREIGN = [number for number in range(0x800) if number not in _OWN]
_LENGTH_LESS = 4  # bytes; CAN FD knows 24 and 20
_BUS_OFF = 0x40  # error class of a SocketCAN error frame, linux/can/error.h
_ERROR_BYTES = 8
_DRIFT = 1000e-6  # 1; the driver follows a quartz of at most 500 ppm
_WIDTH_SAMPLE, _WIDTH_MICROSECOND = 1 << 16, 1 << 32
_US = 1e6  # us per s


def none_sent(fault: Fault, frames: Frames) -> Frames:
    """Send no frame."""
    return []


def bus_off(fault: Fault, frames: Frames) -> Frames:
    """Send the error frame of a controller that is bus off, then nothing.

    An error frame is local to a controller and no bus carries it. SocketCAN shows the controller's own to the
    driver; here the simulator gives it to the driver over a bus of this machine.
    """
    fault.count += 1
    error = can.Message(arbitration_id=_BUS_OFF, is_error_frame=True, data=bytes(_ERROR_BYTES))
    return [error] if fault.count == 1 else []


def lost(share: float) -> Callable[[Fault, Frames], Frames]:
    """Lose this share of the frames, at random."""

    def some(fault: Fault, frames: Frames) -> Frames:
        arriving = fault.random.uniform(len(frames)) >= share
        return [frame for frame, arrives in zip(frames, arriving, strict=True) if arrives]

    return some


def delayed(samples: int) -> Callable[[Fault, Frames], Frames]:
    """Delay frames by some samples; those under way when the fault ends are lost."""

    def late(fault: Fault, frames: Frames) -> Frames:
        fault.past.append(_copies(frames))
        return fault.past.popleft() if len(fault.past) > samples else []

    return late


def duplicated(fault: Fault, frames: Frames) -> Frames:
    """Send each frame twice."""
    return [frame for frame in frames for _ in range(2)]


def reordered(fault: Fault, frames: Frames) -> Frames:
    """Send the frames of every tenth sample after those of the next."""
    fault.count += 1
    if fault.count % _REORDERED == 0:
        fault.past.append(_copies(frames))
        return []
    return frames + fault.past.popleft() if fault.past else frames


def frozen_counter(fault: Fault, frames: Frames) -> Frames:
    """Give all measurements the same alive counter, with a check sum that is right."""
    for frame in frames:
        if frame.arbitration_id == _CODEC.measurement.frame_id:
            alive, measurement = _CODEC.decode_measurement(frame.data)
            frame.data = _CODEC.encode_measurement(measurement, int(fault.keep(alive)))
    return frames


def damaged(damage: Callable[[can.Message], None]) -> Callable[[Fault, Frames], Frames]:
    """Damage the frames of every third sample."""

    def some(fault: Fault, frames: Frames) -> Frames:
        fault.count += 1
        if fault.count % _EVERY == 1:
            for frame in frames:
                damage(frame)
        return frames

    return some


def change_byte(frame: can.Message) -> None:
    """Change the last byte."""
    frame.data[-1] ^= 0xFF


def shorten(frame: can.Message) -> None:
    """Remove the last bytes."""
    frame.data = frame.data[:-_LENGTH_LESS]
    frame.dlc = len(frame.data)


def replayed(fault: Fault, frames: Frames) -> Frames:
    """Send after each frame one of 100 samples ago once more, as it was."""
    fault.past.append(_copies(frames))
    return frames + fault.past.popleft() if len(fault.past) > _REPLAYED else frames


def babbling(fault: Fault, frames: Frames) -> Frames:
    """Add frames of another node, with identifiers that are none of this mount's."""
    numbers = fault.random.uniform(_BABBLED)
    foreign = (Frame(_FOREIGN[int(number * len(_FOREIGN))], number.tobytes()) for number in numbers)
    return [*frames, *foreign]


def drifting_clock(fault: Fault, counters: tuple[int, int]) -> tuple[int, int]:
    """Let the microsecond counter run 1000 ppm too fast."""
    sample, microseconds = counters
    return sample, microseconds + round(_DRIFT * (microseconds - round(fault.begin * _US)))


def wrapping_counters(fault: Fault, counters: tuple[int, int]) -> tuple[int, int]:
    """Let both counters go through their highest value to 0 when the fault begins."""
    sample, microseconds = counters
    wrap = round(fault.begin * fault.sample_rate)
    return (
        sample + _WIDTH_SAMPLE - wrap % _WIDTH_SAMPLE,
        microseconds + _WIDTH_MICROSECOND - round(wrap / fault.sample_rate * _US),
    )


def reset_counters(fault: Fault, counters: tuple[int, int]) -> tuple[int, int]:
    """Start both counters from 0 when the power is back; until then no setpoint is received."""
    back = round(fault.end * fault.sample_rate)
    after = counters[0] - back
    fault.deaf, fault.restarts = after < 0, after == 0
    return counters if fault.deaf else (after, round(after / fault.sample_rate * _US))


def _copies(frames: Frames) -> Frames:
    """Return the frames as they are now, which no later change of the given ones changes."""
    return [Frame(frame.arbitration_id, bytearray(frame.data)) for frame in frames]
