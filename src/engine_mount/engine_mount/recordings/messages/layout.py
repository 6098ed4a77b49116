"""Where the numbers of a serialised message stand, so that thousands of equal messages are read at once.

The walk follows the CDR encoding of the middleware: each number aligned to its own
size counted from behind the 4-byte head, strings and sequences with a length of 4 bytes in front.
Bytes between aligned numbers are undefined and never looked at.
"""

import struct
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from engine_mount.recordings.messages.definitions import Definition, element_of

HEAD = 4  # bytes: kind of encoding and options
OPTIONS = slice(2, HEAD)  # bytes of the head that say nothing of the content
NUMBERS = {
    'boolean': '<u1',
    'octet': '<u1',
    'char': '<u1',
    'float': '<f4',
    'double': '<f8',
    **{f'{sign}int{bits}': f'<{sign or "i"}{bits // 8}' for sign in ('', 'u') for bits in (8, 16, 32, 64)},
}
_ORDERS: dict[bytes, Literal['<', '>']] = {b'\x00\x00': '>', b'\x00\x01': '<'}


class LayoutError(ValueError):
    """A message cannot be read in place; the general deserialiser may still read it."""


@dataclass(frozen=True)
class Numbers:
    """A run of equal numbers in a message."""

    offset: int
    dtype: np.dtype
    count: int

    def column(self, messages: np.ndarray, place: int = 0) -> np.ndarray:
        """Return number `place` of the run from each row of `messages` (rows x bytes)."""
        begin = self.offset + place * self.dtype.itemsize
        return np.ascontiguousarray(messages[:, begin : begin + self.dtype.itemsize]).view(self.dtype)[:, 0]


@dataclass
class Layout:
    """What stands where: runs of numbers and strings by their path, such as `header.stamp.sec`."""

    numbers: dict[str, Numbers] = field(default_factory=dict)
    strings: dict[str, str] = field(default_factory=dict)
    shape: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))  # bytes that fix the layout

    def fits(self, messages: np.ndarray) -> bool:
        """Return whether all rows of `messages` (rows x bytes) have the strings and lengths of the first."""
        return bool((messages[:, self.shape] == messages[0, self.shape]).all())


def layout_of(raw: bytes, definition: Definition) -> Layout:
    """Return the layout of one serialised message; raises `LayoutError`."""
    walk = _Walk(raw, definition)
    try:
        walk.message('', definition.name)
    except (struct.error, UnicodeDecodeError, RecursionError):
        raise LayoutError(f'a message of {len(raw)} bytes is no {definition.name}') from None
    if walk.position > len(raw):
        raise LayoutError(f'a message of {len(raw)} bytes is too short for {definition.name}')
    walk.layout.shape = np.array(walk.shape, np.int64)
    return walk.layout


def byte_order(raw: bytes) -> Literal['<', '>']:
    """Return `<` or `>` of a plain CDR message; raises `LayoutError` for every other encoding."""
    order = _ORDERS.get(raw[:2])
    if order is None or len(raw) < HEAD:
        raise LayoutError(f'a message that begins with {raw[:HEAD].hex() or "nothing"} is no plain CDR')
    return order


class _Walk:
    def __init__(self, raw: bytes, definition: Definition):
        self.layout = Layout()
        self.shape: list[int] = list(range(HEAD - 2))
        self.position = HEAD
        self._raw = raw
        self._definition = definition
        self._order = byte_order(raw)

    def message(self, path: str, name: str) -> None:
        for field_name, field_type in self._definition.types[name].items():
            self.field(f'{path}.{field_name}' if path else field_name, field_type)

    def field(self, path: str, field_type: str) -> None:
        element = element_of(field_type)
        if field_type in NUMBERS:
            self._numbers(path, field_type, 1)
        elif field_type.split('<')[0] == 'string':
            self.layout.strings[path] = self._string()
        elif element != field_type:
            fixed = not field_type.startswith('sequence<')
            count = int(field_type[field_type.rindex('[') + 1 : -1]) if fixed else self._length()
            self._elements(path, element, count)
        elif '/' in field_type:
            self.message(path, field_type)
        else:
            raise LayoutError(f'field {path} of type {field_type} cannot be read in place')

    def _elements(self, path: str, element: str, count: int) -> None:
        if element in NUMBERS:
            self._numbers(path, element, count)
            return
        if count > len(self._raw):
            raise LayoutError(f'field {path} claims {count} elements')
        for place in range(count):
            self.field(f'{path}[{place}]', element)

    def _numbers(self, path: str, field_type: str, count: int) -> None:
        dtype = np.dtype(NUMBERS[field_type]).newbyteorder(self._order)
        if count:
            self._align(dtype.itemsize)
        self.layout.numbers[path] = Numbers(self.position, dtype, count)
        self.position += count * dtype.itemsize

    def _string(self) -> str:
        length = self._length()
        begin, end = self.position, self.position + length
        if end > len(self._raw):
            raise LayoutError(f'a string claims {length} bytes')
        self.shape.extend(range(begin, end))
        self.position = end
        return self._raw[begin : end - 1].decode() if length else ''

    def _length(self) -> int:
        self._align(4)
        length = struct.unpack_from(f'{self._order}I', self._raw, self.position)[0]
        self.shape.extend(range(self.position, self.position + 4))
        self.position += 4
        return length

    def _align(self, size: int) -> None:
        self.position += -(self.position - HEAD) % size
