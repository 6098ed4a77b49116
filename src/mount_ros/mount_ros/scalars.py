"""Named scalars as the CDR bytes of a `sensor_msgs/JointState`, written and read in place.

On the 1 kHz path the layout of these messages never changes: the same names, the same lengths. So the
bytes are made once and afterwards only the stamp and the numbers are replaced. A message of another
layout (a foreign publisher) is read by the general deserialiser, by names.
"""

import functools
import math
import struct
from collections.abc import Sequence
from typing import Any

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from mount_ros.cdr import serialised
from mount_ros.topics import Topic

_STAMP = struct.Struct('<iI')
_STAMP_OFFSET = 4  # behind the CDR encapsulation header
_STAMP_END = _STAMP_OFFSET + _STAMP.size
_NANOSECONDS = 1_000_000_000


class ScalarsError(ValueError):
    """A message lacks a named scalar that its topic declares."""


def stamp_of(raw: bytes) -> int:
    """Return the header stamp of any serialised stamped message, ns."""
    seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_OFFSET)
    return seconds * _NANOSECONDS + nanoseconds


class ScalarsLayout:
    """Packs and unpacks the messages of one topic of named scalars."""

    def __init__(self, topic: Topic):
        self.topic = topic
        self.names = topic.names
        count = len(self.names)
        self._template = bytearray(_template(topic))
        self._numbers = struct.Struct(f'<{count}d')
        self._position_offset = _offset_of(self._template, _marks(count, 0))
        self._velocity_offset = (
            _offset_of(self._template, _marks(count, count)) if topic.has_derivatives else 0
        )
        self._head = bytes(self._template[_STAMP_END : self._position_offset])

    def pack(
        self, stamp: int, positions: Sequence[float], velocities: Sequence[float] | None = None
    ) -> bytes:
        """Return the message of time `stamp` (ns) with these numbers, in the order of the topic's names."""
        message = self._template
        _STAMP.pack_into(message, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        self._numbers.pack_into(message, self._position_offset, *positions)
        if velocities is not None:
            self._numbers.pack_into(message, self._velocity_offset, *velocities)
        return bytes(message)

    def pack_record(self, stamp: int, numbers: bytes) -> bytes:
        """Return the message of time `stamp` (ns) with positions given as little-endian float64 bytes."""
        message = self._template
        _STAMP.pack_into(message, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        message[self._position_offset : self._position_offset + self._numbers.size] = numbers
        return bytes(message)

    def unpack(self, raw: bytes) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """Return (stamp ns, positions, velocities) in the order of the topic's names; velocities may be ().

        Raises `ScalarsError` where a declared name is missing.
        """
        if len(raw) != len(self._template) or raw[_STAMP_END : self._position_offset] != self._head:
            return self._unpack_foreign(raw)
        positions = self._numbers.unpack_from(raw, self._position_offset)
        velocities = self._numbers.unpack_from(raw, self._velocity_offset) if self._velocity_offset else ()
        return stamp_of(raw), positions, velocities

    def _unpack_foreign(self, raw: bytes) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        message = deserialize_message(raw, JointState)
        missing = [name for name in self.names if name not in message.name]
        if missing or len(message.position) != len(message.name):
            raise ScalarsError(
                f'{self.topic.name}: the message names {list(message.name)} with '
                f'{len(message.position)} positions; needed are {list(self.names)} with one position each'
            )
        order = [message.name.index(name) for name in self.names]
        positions = tuple(message.position[index] for index in order)
        if not self._velocity_offset:
            return stamp_of(raw), positions, ()
        full = len(message.velocity) == len(message.name)
        velocities = tuple(message.velocity[index] if full else math.nan for index in order)
        return stamp_of(raw), positions, velocities


class OneNumberLayout:
    """Packs a stamped message of any type in which only the stamp and one number ever change."""

    def __init__(self, message: Any, path: str):
        """Take the message to repeat; `path` names the number, such as `wrench.force.z`."""
        mark = _marks(1, 0)
        *owners, field = path.split('.')
        owner = functools.reduce(getattr, owners, message)
        setattr(owner, field, mark[0])
        self._template = bytearray(serialised(message))
        self._number = struct.Struct('<d')
        self._offset = _offset_of(self._template, mark)

    def pack(self, stamp: int, number: float) -> bytes:
        """Return the message of time `stamp` (ns) with this number."""
        _STAMP.pack_into(self._template, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        self._number.pack_into(self._template, self._offset, number)
        return bytes(self._template)


def _marks(count: int, first: int) -> list[float]:
    """Return numbers that no string in the message can be mistaken for."""
    return [1e300 + 1e290 * (first + index) for index in range(count)]


def _template(topic: Topic) -> bytes:
    count = len(topic.names)
    message = JointState(name=list(topic.names), position=_marks(count, 0))
    if topic.has_derivatives:
        message.velocity = _marks(count, count)
    return serialised(message)


def _offset_of(template: bytearray, numbers: list[float]) -> int:
    return template.index(struct.pack(f'<{len(numbers)}d', *numbers))
