"""Named scalars as the CDR bytes of a `sensor_msgs/JointState`, written and read in place.

On the 1 kHz path the layout of these messages never changes: the same names, the same lengths. So the
bytes are made once and afterwards only the stamp and the numbers are replaced, in one message or, by
`pack_rows`, in many at once. A message of another layout (a foreign publisher) is read by the general
deserialiser, by names.
"""

import functools
import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from mount_ros.messages.cdr import serialised
from mount_ros.topics import Topic

_STAMP = struct.Struct('<iI')
_NUMBER = struct.Struct('<d')
_STAMP_OFFSET = 4  # behind the CDR encapsulation header
_STAMP_END = _STAMP_OFFSET + _STAMP.size
_NANOSECONDS = 1_000_000_000
_LAST_SECOND = 2**31 - 1  # of a stamp: a signed number of 32 bits

Rows = NDArray[np.uint8]
"""Serialised messages of one length, (messages, bytes)."""
Numbers = NDArray[np.float64]


class ScalarsError(ValueError):
    """A message lacks a named scalar that its topic declares, or cannot carry what it shall."""


def stamp_of(raw: bytes) -> int:
    """Return the header stamp of any serialised stamped message, ns; raises `ScalarsError` if it is cut."""
    try:
        seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_OFFSET)
    except struct.error:
        raise ScalarsError(f'a message of {len(raw)} bytes has no stamp') from None
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

    def pack_rows(
        self, stamps: NDArray[np.int64], positions: Numbers, velocities: Numbers | None = None
    ) -> Rows:
        """Return the messages of many `stamps` (ns), numbers (messages, names); the same bytes as `pack`."""
        rows = _stamped_rows(self._template, stamps)
        _put_numbers(rows, self._position_offset, positions)
        if velocities is not None:
            _put_numbers(rows, self._velocity_offset, velocities)
        return rows

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
        message = _decoded(raw)
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


class ScalarsReader:
    """Reads some named scalars out of `JointState` messages that name what they like, NaN where one lacks.

    It remembers the layout of the last message, and reads the next ones of the same layout in place.
    """

    def __init__(self, names: Sequence[str]):
        self._names = names
        self._head, self._size = b'', 0
        self._places: list[int | None] = []
        self._begin = 0

    def read(self, raw: bytes) -> tuple[int, list[float]]:
        """Return (stamp ns, positions) in the order of the names."""
        if len(raw) != self._size or raw[_STAMP_END : self._begin] != self._head:
            self._learn(raw)
        numbers = [
            math.nan if place is None else _NUMBER.unpack_from(raw, place)[0] for place in self._places
        ]
        return stamp_of(raw), numbers

    def _learn(self, raw: bytes) -> None:
        message = _decoded(raw)
        names = list(message.name)
        if len(message.position) != len(names):
            raise ScalarsError(f'a message with {len(names)} names has {len(message.position)} positions')
        message.position = _marks(len(names), 0)
        marked = bytearray(serialised(message))
        if len(marked) > len(raw):
            raise ScalarsError(f'a message of {len(raw)} bytes is cut; its content takes {len(marked)}')
        self._begin = _offset_of(marked, _marks(len(names), 0)) if names else _STAMP_END
        self._head, self._size = raw[_STAMP_END : self._begin], len(raw)
        self._places = [
            self._begin + _NUMBER.size * names.index(name) if name in names else None for name in self._names
        ]


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

    def pack_rows(self, stamps: NDArray[np.int64], numbers: Numbers) -> Rows:
        """Return the messages of many `stamps` (ns) with one number each; the same bytes as `pack`."""
        rows = _stamped_rows(self._template, stamps)
        _put_numbers(rows, self._offset, np.reshape(numbers, (-1, 1)))
        return rows


def _decoded(raw: bytes) -> JointState:
    try:
        return deserialize_message(raw, JointState)
    except (RuntimeError, ValueError) as error:  # of the middleware; of a name that is no UTF-8
        raise ScalarsError(f'a message of {len(raw)} bytes is no JointState ({error})') from None


def _stamped_rows(template: bytearray, stamps: NDArray[np.int64]) -> Rows:
    """Return one copy of the message for each stamp (ns), with the stamp in it."""
    rows = np.tile(np.frombuffer(template, np.uint8), (len(stamps), 1))
    seconds, nanoseconds = np.divmod(stamps, _NANOSECONDS)
    if len(stamps) and not -_LAST_SECOND <= seconds.min() <= seconds.max() <= _LAST_SECOND:
        raise ScalarsError(f'stamps must lie within {_LAST_SECOND} s around 0, these reach {stamps.max()} ns')
    middle = _STAMP_OFFSET + 4
    rows[:, _STAMP_OFFSET:middle] = _as_bytes(seconds, '<i4')
    rows[:, middle:_STAMP_END] = _as_bytes(nanoseconds, '<u4')
    return rows


def _put_numbers(rows: Rows, offset: int, numbers: Numbers) -> None:
    raw = _as_bytes(numbers, '<f8')
    rows[:, offset : offset + raw.shape[1]] = raw


def _as_bytes(values: NDArray[Any], kind: str) -> Rows:
    """Return the bytes of each row of numbers, (rows, bytes)."""
    encoded = np.ascontiguousarray(values, kind)
    return encoded.view(np.uint8).reshape(len(encoded), encoded.itemsize * math.prod(encoded.shape[1:]))


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
