"""Named scalars as the CDR bytes of a `sensor_msgs/JointState`, written and read in place.

On the 1 kHz path the layout of these messages never changes: the same names, the same lengths. So the
bytes are made once and afterwards only the stamp and the numbers are replaced, in one message or, by
`pack_rows`, in many at once. A message of another layout (a foreign publisher) is read by the general
deserialiser, by names.
"""

import math
import struct
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_ros.messages.cdr import deserialise, joint_state
from mount_ros.topics import COIL_TEMPERATURE, JOINT_STATE, Topic, control_trace

_STAMP = struct.Struct('<iI')
_STAMP_OFFSET = 4  # behind the CDR encapsulation header
_STAMP_END = _STAMP_OFFSET + _STAMP.size
_NANOSECONDS = 1_000_000_000
_LAST_SECOND = 2**31 - 1  # of a stamp: a signed number of 32 bits

Rows = NDArray[np.uint8]
"""Serialised messages of one length, (messages, bytes)."""
Numbers = NDArray[np.float64]


class MessageError(ValueError):
    """A serialised message is not what its topic holds; the text says why."""


def stamp_of(raw: bytes) -> int:
    """Return the header stamp of any serialised stamped message, ns; raises `MessageError` if it is cut."""
    try:
        seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_OFFSET)
    except struct.error:
        raise MessageError(f'a message of {len(raw)} bytes has no stamp') from None
    return seconds * _NANOSECONDS + nanoseconds


class _Layout:
    """The bytes of a stamped message in which only the stamp and some runs of numbers ever change."""

    def __init__(self, message: bytes, *runs: list[float]):
        """Take the message to repeat, with `runs` of marks where the numbers stand."""
        self._template = bytearray(message)
        self._numbers = struct.Struct(f'<{len(runs[0])}d')
        self._offsets = [self._template.index(self._numbers.pack(*run)) for run in runs]

    def pack_rows(self, stamps: NDArray[np.int64], *runs: Numbers | None) -> Rows:
        """Return the messages of many `stamps` (ns), runs (messages, numbers); the same bytes as `pack`."""
        rows = np.tile(np.frombuffer(self._template, np.uint8), (len(stamps), 1))
        if len(stamps) == 0:
            return rows
        seconds, nanoseconds = np.divmod(stamps, _NANOSECONDS)
        if not -_LAST_SECOND <= seconds.min() <= seconds.max() <= _LAST_SECOND:
            raise MessageError(
                f'stamps must lie within {_LAST_SECOND} s around 0, these reach {stamps.max()} ns'
            )
        columns: list[tuple[int, Any, str]] = [(_STAMP_OFFSET, seconds, '<i4')]
        columns += [(_STAMP_OFFSET + 4, nanoseconds, '<u4')]
        columns += [(offset, run, '<f8') for offset, run in zip(self._offsets, runs, strict=False)]
        for offset, values, kind in columns:
            if values is not None:
                raw = np.ascontiguousarray(values, kind).view(np.uint8).reshape(len(rows), -1)
                rows[:, offset : offset + raw.shape[1]] = raw
        return rows


class ScalarsLayout(_Layout):
    """Packs and unpacks the messages of one topic of named scalars."""

    def __init__(self, topic: Topic):
        self.topic = topic
        self.names = topic.names
        count = len(self.names)
        runs = [_marks(count, 0), _marks(count, count)][: 1 + topic.has_derivatives]
        super().__init__(joint_state(self.names, *runs), *runs)
        self._begin, self._velocity_offset = self._offsets[0], self._offsets[-1] if runs[1:] else 0
        self._head = bytes(self._template[_STAMP_END : self._begin])

    def pack(
        self, stamp: int, positions: Sequence[float], velocities: Sequence[float] | None = None
    ) -> bytes:
        """Return the message of time `stamp` (ns) with these numbers, in the order of the topic's names."""
        message = self._template
        _STAMP.pack_into(message, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        self._numbers.pack_into(message, self._begin, *positions)
        if velocities is not None:
            self._numbers.pack_into(message, self._velocity_offset, *velocities)
        return bytes(message)

    def pack_record(self, stamp: int, numbers: bytes) -> bytes:
        """Return the message of time `stamp` (ns) with positions given as little-endian float64 bytes."""
        message = self._template
        _STAMP.pack_into(message, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        message[self._begin : self._begin + len(numbers)] = numbers
        return bytes(message)

    def fits(self, raw: bytes) -> bool:
        """Return whether a message has this layout."""
        return len(raw) == len(self._template) and raw[_STAMP_END : self._begin] == self._head

    def unpack(self, raw: bytes) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """Return (stamp ns, positions, velocities) in the order of the topic's names; velocities may be ().

        Raises `MessageError` where a declared name is missing.
        """
        if len(raw) != len(self._template) or raw[_STAMP_END : self._begin] != self._head:
            return self._unpack_foreign(raw)
        seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_OFFSET)
        positions = self._numbers.unpack_from(raw, self._begin)
        velocities = self._numbers.unpack_from(raw, self._velocity_offset) if self._velocity_offset else ()
        return seconds * _NANOSECONDS + nanoseconds, positions, velocities

    def _unpack_foreign(self, raw: bytes) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        message = _decoded(raw)
        if not {*self.names} <= {*message.name} or len(message.position) != len(message.name):
            raise MessageError(
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
        self._wanted = names
        self._learn(names)

    def read(self, raw: bytes) -> tuple[int, list[float]]:
        """Return (stamp ns, positions) in the order of the names."""
        if not self._layout.fits(raw):
            self._learn(_decoded(raw).name)
        stamp, positions, _ = self._layout.unpack(raw)
        return stamp, [math.nan if place is None else positions[place] for place in self._places]

    def _learn(self, names: Sequence[str]) -> None:
        self._layout = ScalarsLayout(control_trace(names))
        places = {name: place for place, name in enumerate(names)}
        self._places = [places.get(name) for name in self._wanted]


class OneNumberLayout(_Layout):
    """Packs a stamped message of any type in which only the stamp and one number ever change."""

    def __init__(self, build: Callable[[float], bytes]):
        """Take the function that builds the message of a number, such as `mount_ros.messages.cdr.wrench`."""
        mark = _marks(1, 0)
        super().__init__(build(mark[0]), mark)

    def pack(self, stamp: int, number: float) -> bytes:
        """Return the message of time `stamp` (ns) with this number."""
        _STAMP.pack_into(self._template, _STAMP_OFFSET, *divmod(stamp, _NANOSECONDS))
        self._numbers.pack_into(self._template, self._offsets[0], number)
        return bytes(self._template)


def temperature_of(raw: bytes) -> tuple[int, float]:
    """Return stamp (ns) and temperature (degC) of a serialised message."""
    return stamp_of(raw), float(deserialise(raw, COIL_TEMPERATURE.type).temperature)


def _decoded(raw: bytes) -> Any:
    try:
        return deserialise(raw, JOINT_STATE)
    except (RuntimeError, ValueError) as error:  # of the middleware; of a name that is no UTF-8
        raise MessageError(f'a message of {len(raw)} bytes is no JointState ({error})') from None


def _marks(count: int, first: int) -> list[float]:
    """Return numbers that no string in the message can be mistaken for."""
    return [1e300 + 1e290 * (first + index) for index in range(count)]
