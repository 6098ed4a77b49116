"""Decodes any serialised message by its definition, one by one, whether its type is installed or not.

Columns of numbers do not come this way (`layout`): the displacement of 10 min at 1 kHz takes 3.2 s of CPU
time, with rosbags 7.8 s (measured). One report of diagnostics takes 57 us, with rclpy 37 us, but to load that
takes 0.1 s; a `JointState` 15 us, with rosbags 4 us, which would be one more library in the car.
"""

import struct
from types import SimpleNamespace
from typing import Any

import numpy as np

from engine_mount.recordings.messages.definitions import Definition, element_of
from engine_mount.recordings.messages.layout import HEAD, NUMBERS, LayoutError, byte_order

_LENGTH_BYTES = 4
_CODES = {
    'boolean': '?',
    'octet': 'B',
    'char': 'B',
    'float': 'f',
    'double': 'd',
    **dict(zip(('int8', 'int16', 'int32', 'int64'), 'bhiq', strict=True)),
    **dict(zip(('uint8', 'uint16', 'uint32', 'uint64'), 'BHIQ', strict=True)),
}
_SIZES = {kind: struct.calcsize(f'<{code}') for kind, code in _CODES.items()}


def decode(raw: bytes, definition: Definition) -> SimpleNamespace:
    """Return the message in `raw` with its fields as attributes; raises `LayoutError`.

    Sequences and arrays of numbers are NumPy arrays, all others are lists.
    """
    reader = _Reader(raw, definition)
    try:
        return reader.message(definition.name)
    except (struct.error, UnicodeDecodeError, IndexError, RecursionError):
        raise LayoutError(f'a message of {len(raw)} bytes is no {definition.name}') from None


class _Reader:
    def __init__(self, raw: bytes, definition: Definition):
        self._raw = raw
        self._definition = definition
        self._order = byte_order(raw)
        self._position = HEAD

    def message(self, name: str) -> SimpleNamespace:
        fields = self._definition.types[name]
        return SimpleNamespace(**{field: self._value(kind) for field, kind in fields.items()})

    def _value(self, kind: str) -> Any:
        element = element_of(kind)
        if element != kind:
            count = self._length() if kind.startswith('sequence<') else int(kind[kind.rindex('[') + 1 : -1])
            return self._values(element, count)
        if kind in NUMBERS:
            return self._number(kind)
        if kind.startswith('string'):
            return self._string()
        if '/' in kind:
            return self.message(kind)
        raise LayoutError(f'a field of type {kind} cannot be read')

    def _values(self, element: str, count: int) -> Any:
        if element in NUMBERS:
            return self._numbers(element, count)
        if count > len(self._raw):
            raise LayoutError(f'a message of {len(self._raw)} bytes claims {count} elements')
        return [self._value(element) for _ in range(count)]

    def _number(self, kind: str) -> Any:
        self._align(_SIZES[kind])
        number = struct.unpack_from(self._order + _CODES[kind], self._raw, self._position)[0]
        self._position += _SIZES[kind]
        return number

    def _numbers(self, kind: str, count: int) -> np.ndarray:
        dtype = np.dtype(NUMBERS[kind]).newbyteorder(self._order)
        if count:
            self._align(dtype.itemsize)
        begin, end = self._position, self._position + count * dtype.itemsize
        if end > len(self._raw):
            raise LayoutError(f'a message of {len(self._raw)} bytes is too short for {self._definition.name}')
        self._position = end
        return np.frombuffer(self._raw, dtype, count, begin) if count else np.empty(0, dtype)

    def _string(self) -> str:
        length = self._length()
        begin, end = self._position, self._position + length
        if end > len(self._raw):
            raise LayoutError(f'a string claims {length} bytes')
        self._position = end
        return self._raw[begin : end - 1].decode() if length else ''

    def _length(self) -> int:
        self._align(_LENGTH_BYTES)
        length = struct.unpack_from(f'{self._order}I', self._raw, self._position)[0]
        self._position += _LENGTH_BYTES
        return length

    def _align(self, size: int) -> None:
        self._position += -(self._position - HEAD) % size
