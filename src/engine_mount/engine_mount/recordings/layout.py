"""What stands where in a serialised message, so that thousands of equal messages are read at once.

The reader follows the CDR encoding of the middleware: each number aligned to its own
size counted from behind the 4-byte head, strings and sequences with a length of 4 bytes in front.
Bytes between aligned numbers are undefined and never looked at.
"""

import struct
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from engine_mount.recordings.definitions import NUMBERS, STRING, Definition

HEAD = 4  # bytes: kind of encoding and options
OPTIONS = slice(2, HEAD)  # bytes of the head that say nothing of the content
_ORDERS: dict[bytes, Literal['<', '>']] = {b'\x00\x00': '>', b'\x00\x01': '<'}


class LayoutError(ValueError):
    """A message is not as its definition says."""


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
    shape: list[int] = field(default_factory=lambda: list(range(OPTIONS.start)))  # bytes that fix the layout

    def fits(self, messages: np.ndarray) -> bool:
        """Return whether all rows of `messages` (rows x bytes) have the strings and lengths of the first."""
        mask = np.zeros(messages.shape[1], np.uint8)
        mask[self.shape] = 255
        different = messages ^ messages[0]
        different &= mask
        return int(different.max(initial=0)) == 0


def layout_of(raw: bytes, definition: Definition) -> Layout:
    """Return the layout of one serialised message; raises `LayoutError`."""
    return _read(raw, definition)[1]


def decode(raw: bytes, definition: Definition) -> SimpleNamespace:
    """Return the message in `raw` with its fields as attributes; raises `LayoutError`.

    Sequences and arrays of numbers are NumPy arrays, all others are lists.
    """
    return _read(raw, definition)[0]


def _read(raw: bytes, definition: Definition) -> tuple[SimpleNamespace, Layout]:
    reader = _Reader(raw, definition)
    try:
        return reader.message('', definition.name), reader.layout
    except (struct.error, UnicodeDecodeError, RecursionError):
        raise LayoutError(f'a message of {len(raw)} bytes is no {definition.name}') from None


class _Reader:
    def __init__(self, raw: bytes, definition: Definition):
        order = _ORDERS.get(raw[:2])
        if order is None or len(raw) < HEAD:
            raise LayoutError(f'a message that begins with {raw[:HEAD].hex() or "nothing"} is no plain CDR')
        self.layout = Layout()
        self._raw, self._definition, self._order, self._position = raw, definition, order, HEAD

    def message(self, path: str, name: str) -> SimpleNamespace:
        fields = self._definition.types[name]
        prefix = f'{path}.' if path else ''
        return SimpleNamespace(**{key: self._field(prefix + key, *fields[key]) for key in fields})

    def _field(self, path: str, kind: str, length: int | None) -> Any:
        if length is None:
            return self._value(path, kind)
        count = self._length() if length < 0 else length
        if kind in NUMBERS:
            return self._numbers(path, kind, count)
        if count > len(self._raw):
            raise LayoutError(f'field {path} claims {count} elements')
        return [self._value(f'{path}[{place}]', kind) for place in range(count)]

    def _value(self, path: str, kind: str) -> Any:
        if kind in NUMBERS:
            number = self._numbers(path, kind, 1)[0].item()
            return bool(number) if kind == 'bool' else number
        if kind == STRING:
            return self._string(path)
        if '/' in kind:
            return self.message(path, kind)
        raise LayoutError(f'field {path} of type {kind} cannot be read')

    def _numbers(self, path: str, kind: str, count: int) -> np.ndarray:
        dtype = np.dtype(self._order + NUMBERS[kind])
        if count:
            self._align(dtype.itemsize)
        begin = self._position
        self._advance(count * dtype.itemsize)
        self.layout.numbers[path] = Numbers(begin, dtype, count)
        return np.frombuffer(self._raw, dtype, count, begin) if count else np.empty(0, dtype)

    def _string(self, path: str) -> str:
        length, begin = self._length(), self._position
        self._advance(length)
        self.layout.shape.extend(range(begin, self._position))
        self.layout.strings[path] = text = self._raw[begin : self._position - 1].decode() if length else ''
        return text

    def _length(self) -> int:
        self._align(4)
        begin = self._position
        self._advance(4)
        self.layout.shape.extend(range(begin, self._position))
        return int(struct.unpack_from(f'{self._order}I', self._raw, begin)[0])

    def _advance(self, size: int) -> None:
        self._position += size
        if self._position > len(self._raw):
            name = self._definition.name
            raise LayoutError(f'a message of {len(self._raw)} bytes is too short for {name}')

    def _align(self, size: int) -> None:
        self._position += -(self._position - HEAD) % size
