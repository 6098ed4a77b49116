"""The fields of a message, and what stands where in its bytes, so that thousands are read at once.

The definition in a recording counts: it is the one that the messages were written with; without one, that of
the installed type. The encoding is the CDR of the middleware: each number aligned to its own size counted
from behind the 4-byte head, strings and sequences with a length of 4 bytes in front. Bytes between aligned
numbers are undefined and never looked at.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Any, Literal, NamedTuple

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import TypesysError, get_types_from_msg

from mount_recorder.schemas import schema_text

_HEAD = 4  # bytes: kind of encoding, and two of options that say nothing of the content
_ORDERS: dict[bytes, Literal['<', '>']] = {b'\x00\x00': '>', b'\x00\x01': '<'}
_NUMBERS = {
    **{'bool': 'u1', 'byte': 'u1', 'char': 'u1', 'octet': 'u1', 'float32': 'f4', 'float64': 'f8'},
    **{f'{sign}int{bits}': f'{sign or "i"}{bits // 8}' for sign in ('', 'u') for bits in (8, 16, 32, 64)},
}
# The middleware gives a message without fields one byte, so that it is not empty.
_EMPTY = [('structure_needs_at_least_one_member', (Nodetype.BASE, ('uint8', 0)))]
Fields = Sequence[tuple[str, Any]]
"""Name and kind of each field, as `rosbags` describes it."""


class DefinitionError(ValueError):
    """A message definition is not understood; the text says what of it."""


class LayoutError(ValueError):
    """A message is not as its definition says."""


class Definition(NamedTuple):
    """The fields of a type and of all types within it, by names such as `std_msgs/msg/Header`."""

    name: str
    types: Mapping[str, Fields]


@cache
def text_definition(type_name: str, text: str) -> Definition:
    """Return the definition of `type_name` in a `ros2msg` text; raises `DefinitionError`."""
    try:
        types = {name: fields or _EMPTY for name, (_, fields) in get_types_from_msg(text, type_name).items()}
    except (TypesysError, ValueError) as error:
        raise DefinitionError(str(error).splitlines()[0]) from None
    for fields in list(types.values()):
        for _, (kind, inner) in fields:
            name = inner[0][1] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else inner
            if isinstance(name, str) and name not in types:
                raise DefinitionError(f'the definition of {type_name} does not say what {name} is')
    return Definition(type_name, types)


@cache
def installed_definition(type_name: str) -> Definition:
    """Return the definition of an installed type; raises `ValueError` if there is none."""
    return text_definition(type_name, schema_text(type_name))


@dataclass(frozen=True)
class Numbers:
    """A run of equal numbers in a message."""

    offset: int
    dtype: np.dtype
    count: int

    def bytes_at(self, place: int) -> range:
        """Return which bytes of a message are number `place` of the run."""
        begin = self.offset + place * self.dtype.itemsize
        return range(begin, begin + self.dtype.itemsize)

    def column(self, messages: np.ndarray, place: int = 0) -> np.ndarray:
        """Return number `place` of the run from each row of `messages` (rows x bytes)."""
        own = self.bytes_at(place)
        return messages[:, own.start : own.stop].view(self.dtype)[:, 0]


@dataclass
class Layout:
    """What stands where: runs of numbers and strings by their path, such as `header.stamp.sec`."""

    numbers: dict[str, Numbers] = field(default_factory=dict)
    strings: dict[str, str] = field(default_factory=dict)
    shape: list[int] = field(default_factory=lambda: [0, 1])
    """Bytes that fix the layout."""

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
        if order is None or len(raw) < _HEAD:
            raise LayoutError(f'a message that begins with {raw[:_HEAD].hex() or "nothing"} is no plain CDR')
        self.layout = Layout()
        self._raw, self._definition, self._order, self._position = raw, definition, order, _HEAD

    def message(self, path: str, name: str) -> SimpleNamespace:
        prefix = f'{path}.' if path else ''
        fields = self._definition.types[name]
        return SimpleNamespace(**{key: self._field(prefix + key, *kind) for key, kind in fields})

    def _field(self, path: str, kind: Nodetype, inner: Any) -> Any:
        if kind == Nodetype.NAME:
            return self.message(path, inner)
        if kind == Nodetype.BASE:
            if inner[0] != 'string':
                number = self._numbers(path, inner[0], 1)[0].item()
                return bool(number) if inner[0] == 'bool' else number
            length = self._length()
            begin = self._skip(length, fixed=True)
            self.layout.strings[path] = text = self._raw[begin : max(begin, begin + length - 1)].decode()
            return text
        element, count = inner
        if kind == Nodetype.SEQUENCE:
            count = self._length()
        if element[0] == Nodetype.BASE and element[1][0] in _NUMBERS:
            return self._numbers(path, element[1][0], count)
        if count > len(self._raw):
            raise LayoutError(f'field {path} claims {count} elements')
        return [self._field(f'{path}[{place}]', *element) for place in range(count)]

    def _numbers(self, path: str, kind: str, count: int) -> np.ndarray:
        if kind not in _NUMBERS:
            raise LayoutError(f'field {path} of type {kind} cannot be read')
        dtype = np.dtype(self._order + _NUMBERS[kind])
        begin = self._skip(count * dtype.itemsize, dtype.itemsize if count else 1)
        self.layout.numbers[path] = Numbers(begin, dtype, count)
        return np.frombuffer(self._raw, dtype, count, begin) if count else np.empty(0, dtype)

    def _length(self) -> int:
        begin = self._skip(4, 4, fixed=True)
        return int(struct.unpack_from(f'{self._order}I', self._raw, begin)[0])

    def _skip(self, size: int, alignment: int = 1, *, fixed: bool = False) -> int:
        """Return where the next `size` bytes begin; `fixed`: they are part of the layout."""
        begin = self._position + -(self._position - _HEAD) % alignment
        self._position = begin + size
        if self._position > len(self._raw):
            name = self._definition.name
            raise LayoutError(f'a message of {len(self._raw)} bytes is too short for {name}')
        if fixed:
            self.layout.shape.extend(range(begin, self._position))
        return begin
