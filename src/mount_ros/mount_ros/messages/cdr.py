"""Messages as CDR bytes that are the same for the same message, every time.

The middleware leaves whatever was in its buffer in the bytes that only pad a field to its alignment, and
a few of them behind the end, which strict readers refuse. So two equal messages may differ in a recording.
Here padding is zero and nothing follows the end. It is plain Python: for set-up and for
rare messages; the 1 kHz path patches bytes that were made once (`mount_ros.messages.scalars`).
"""

import importlib
import re
import struct
from typing import Any

_ENCAPSULATION = b'\x00\x01\x00\x00'  # CDR, little endian
_PRIMITIVES = {
    'boolean': '?',
    'uint8': 'B',
    'int8': 'b',
    'uint16': 'H',
    'int16': 'h',
    'uint32': 'I',
    'int32': 'i',
    'uint64': 'Q',
    'int64': 'q',
    'float': 'f',
    'double': 'd',
}
_SEQUENCE = re.compile(r'sequence<([^,>]+)(?:, *\d+)?>')
_ARRAY = re.compile(r'(.+)\[\d+\]')


def message_class(name: str) -> type:
    """Return the class of a type such as `sensor_msgs/msg/JointState`; raises `ValueError` if unknown."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), kind)
    except (ImportError, AttributeError, TypeError, ValueError):
        raise ValueError(f'message type {name!r} is not installed; is its package missing?') from None


def serialised(message: Any) -> bytes:
    """Return the CDR bytes of a message, with zeros in all padding."""
    stream = bytearray()
    _write_message(stream, message)
    return _ENCAPSULATION + bytes(stream)


def _write_message(stream: bytearray, message: Any) -> None:
    for name, kind in message.get_fields_and_field_types().items():
        _write(stream, kind, getattr(message, name))


def _write(stream: bytearray, kind: str, value: Any) -> None:
    if kind == 'octet':
        stream += value
    elif kind in _PRIMITIVES:
        _write_numbers(stream, _PRIMITIVES[kind], value)
    elif kind.startswith('string'):
        text = value.encode() + b'\x00'
        _write_numbers(stream, 'I', len(text))
        stream += text
    elif many := _SEQUENCE.fullmatch(kind) or _ARRAY.fullmatch(kind):
        if many.re is _SEQUENCE:
            _write_numbers(stream, 'I', len(value))
        if many[1] in _PRIMITIVES:
            _write_numbers(stream, _PRIMITIVES[many[1]], *value)
        else:
            for each in value:
                _write(stream, many[1], each)
    else:
        _write_message(stream, value)


def _write_numbers(stream: bytearray, code: str, *values: Any) -> None:
    if values:
        stream += bytes(-len(stream) % struct.calcsize(code))
        stream += struct.pack(f'<{len(values)}{code}', *values)
