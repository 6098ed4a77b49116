"""Where the numbers of a serialised message stand, so that thousands of equal messages are read at once.

The walk follows the CDR encoding of the middleware: little-endian, each number aligned to its own
size counted from behind the 4-byte head, strings and sequences with a length of 4 bytes in front.
Bytes between aligned numbers are undefined and never looked at.
"""

import re
import struct
from dataclasses import dataclass, field

import numpy as np

from mount_ros.message_types import message_class

HEAD = 4  # bytes: kind of encoding and options
_LITTLE_ENDIAN = b'\x00\x01'
_LENGTH = struct.Struct('<I')
_NUMBERS = {
    'boolean': '<u1',
    'octet': '<u1',
    'char': '<u1',
    'float': '<f4',
    'double': '<f8',
    **{f'{sign}int{bits}': f'<{sign or "i"}{bits // 8}' for sign in ('', 'u') for bits in (8, 16, 32, 64)},
}
_TYPE_NAME = re.compile(r'[A-Za-z]\w*/msg/[A-Za-z]\w*')
_SEQUENCE = re.compile(r'sequence<(.+?)(?:, \d+)?>')
_ARRAY = re.compile(r'(.+)\[(\d+)\]')
_STRING = re.compile(r'string(?:<\d+>)?')


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


def layout_of(raw: bytes, type_name: str) -> Layout:
    """Return the layout of one serialised message; raises `LayoutError`, `ValueError` for unknown types."""
    if raw[:2] != _LITTLE_ENDIAN:
        raise LayoutError(f'encoding {raw[:2].hex()} is not little-endian CDR')
    walk = _Walk(raw)
    try:
        walk.message('', installed_class(type_name))
    except (struct.error, UnicodeDecodeError):
        raise LayoutError(f'a message of {len(raw)} bytes is no {type_name}') from None
    if walk.position > len(raw):
        raise LayoutError(f'a message of {len(raw)} bytes is too short for {type_name}')
    walk.layout.shape = np.array(walk.shape, np.int64)
    return walk.layout


def installed_class(type_name: str) -> type:
    """Return the message class of a type name that a file gives; raises `ValueError`."""
    if not _TYPE_NAME.fullmatch(type_name):
        raise ValueError(f'{type_name!r} is no message type')
    return message_class(type_name)


class _Walk:
    def __init__(self, raw: bytes):
        self.layout = Layout()
        self.shape: list[int] = list(range(HEAD - 2))
        self.position = HEAD
        self._raw = raw

    def message(self, path: str, kind: type) -> None:
        for name, field_type in kind.get_fields_and_field_types().items():  # type: ignore[attr-defined]
            self.field(f'{path}.{name}' if path else name, field_type)

    def field(self, path: str, field_type: str) -> None:
        if field_type in _NUMBERS:
            self._numbers(path, field_type, 1)
        elif _STRING.fullmatch(field_type):
            self.layout.strings[path] = self._string()
        elif match := _ARRAY.fullmatch(field_type):
            self._elements(path, match[1], int(match[2]))
        elif match := _SEQUENCE.fullmatch(field_type):
            self._elements(path, match[1], self._length())
        elif '/' in field_type:
            package, kind = field_type.split('/')
            self.message(path, message_class(f'{package}/msg/{kind}'))
        else:
            raise LayoutError(f'field {path} of type {field_type} cannot be read in place')

    def _elements(self, path: str, element: str, count: int) -> None:
        if element in _NUMBERS:
            self._numbers(path, element, count)
            return
        if count > len(self._raw):
            raise LayoutError(f'field {path} claims {count} elements')
        for place in range(count):
            self.field(f'{path}[{place}]', element)

    def _numbers(self, path: str, field_type: str, count: int) -> None:
        dtype = np.dtype(_NUMBERS[field_type])
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
        length = _LENGTH.unpack_from(self._raw, self.position)[0]
        self.shape.extend(range(self.position, self.position + 4))
        self.position += 4
        return length

    def _align(self, size: int) -> None:
        self.position += -(self.position - HEAD) % size
