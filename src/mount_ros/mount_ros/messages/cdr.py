"""Messages as CDR bytes that are the same for the same message, every time.

The middleware leaves whatever was in its buffer in the bytes that only pad a field to its alignment, and
a few of them behind the end, which strict readers refuse. So two equal messages may differ in a recording.
Here padding is zero and nothing follows the end. To write them no middleware is loaded: a desk without ROS
writes the same bytes. It is plain Python: for set-up and for rare messages; the 1 kHz path patches bytes
that were made once (`mount_ros.messages.scalars`).
"""

import importlib
import struct
from collections.abc import Sequence
from functools import cache
from typing import Any, Self

_ENCAPSULATION = b'\x00\x01\x00\x00'  # CDR, little endian


class CdrWriter:
    """The bytes of one message, field by field."""

    def __init__(self) -> None:
        self._stream = bytearray()

    @property
    def raw(self) -> bytes:
        """The message so far."""
        return _ENCAPSULATION + bytes(self._stream)

    def numbers(self, code: str, *values: float) -> Self:
        """Add numbers of one kind, by its code in `struct`."""
        if values:
            self._stream += bytes(-len(self._stream) % struct.calcsize(code))
            self._stream += struct.pack(f'<{len(values)}{code}', *values)
        return self

    def sequence(self, code: str, values: Sequence[float] = ()) -> Self:
        """Add a sequence of numbers."""
        return self.numbers('I', len(values)).numbers(code, *values)

    def texts(self, *texts: str) -> Self:
        """Add texts, one behind the other."""
        for text in texts:
            encoded = text.encode() + b'\x00'
            self.numbers('I', len(encoded))
            self._stream += encoded
        return self

    def header(self, frame: str = '') -> Self:
        """Add a `std_msgs/Header` with the stamp 0."""
        return self.numbers('I', 0, 0).texts(frame)


def string_message(text: str) -> bytes:
    """Return a `std_msgs/String`."""
    return CdrWriter().texts(text).raw


def joint_state(names: Sequence[str], positions: Sequence[float], velocities: Sequence[float] = ()) -> bytes:
    """Return a `sensor_msgs/JointState` with the stamp 0."""
    head = CdrWriter().header().numbers('I', len(names)).texts(*names)
    return head.sequence('d', positions).sequence('d', velocities).sequence('d').raw


def temperature(celsius: float) -> bytes:
    """Return a `sensor_msgs/Temperature` with the stamp 0; its variance is 0, which means unknown."""
    return CdrWriter().header().numbers('d', celsius, 0.0).raw


def accelerometer(acceleration: float) -> bytes:
    """Return the `sensor_msgs/Imu` with the stamp 0 of an accelerometer on the chassis, upwards, m/s^2.

    It knows neither orientation nor rotation: the first covariance of each is -1 by the definition.
    """
    level, unknown, known = (0.0, 0.0, 0.0, 1.0), (-1.0, *[0.0] * 8), [0.0] * 9
    rotation, accelerations = (*[0.0] * 3, *unknown), (0.0, 0.0, acceleration, *known)
    return CdrWriter().header('mount_chassis').numbers('d', *level, *unknown, *rotation, *accelerations).raw


def wrench(force: float) -> bytes:
    """Return a `geometry_msgs/WrenchStamped` with the stamp 0 and a force along z, N."""
    return CdrWriter().header().numbers('d', 0.0, 0.0, force, 0.0, 0.0, 0.0).raw


@cache
def message_class(name: str) -> type:
    """Return the class of a type such as `sensor_msgs/msg/JointState`; raises `ValueError` if unknown."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), kind)
    except (ImportError, AttributeError, TypeError, ValueError):
        raise ValueError(f'message type {name!r} is not installed; is its package missing?') from None


def deserialise(raw: bytes, type_name: str) -> Any:
    """Return the message that the middleware reads in `raw`; what it raises is the caller's."""
    from rclpy.serialization import deserialize_message  # readers of recordings do without the middleware

    return deserialize_message(raw, message_class(type_name))
