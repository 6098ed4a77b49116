"""What fields a message has: from the definition that stands in a recording, or from the installed type.

The definition in the recording counts: it is the one that the messages were written with.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from mount_recorder.schemas import schema_text

_DELIMITER = re.compile(r'^={80}\s*$', re.MULTILINE)
_PART_NAME = re.compile(r'\s*MSG:\s*([\w/]+)[ \t]*\n?')
_FIELD = re.compile(r'([A-Za-z][\w/]*)(<=\d+)?(\[[^\]]*\])?[ \t]+([A-Za-z]\w*)[ \t]*(=)?.*')
_ARRAY = re.compile(r'\[(<=\d+)?(\d*)\]')
STRING = 'string'
NUMBERS = {
    'bool': 'u1',
    'byte': 'u1',
    'char': 'u1',
    'float32': 'f4',
    'float64': 'f8',
    **{f'{sign}int{bits}': f'{sign or "i"}{bits // 8}' for sign in ('', 'u') for bits in (8, 16, 32, 64)},
}
"""Kinds of numbers, as NumPy spells them without their byte order."""


class DefinitionError(ValueError):
    """A message definition is not understood; the text says what of it."""


class Field(NamedTuple):
    """One value of a `kind`, a sequence of them (`length` -1), or an array of that length.

    `kind` is one of `NUMBERS`, a `STRING`, or a type such as `std_msgs/Header`.
    """

    kind: str
    length: int | None = None


Fields = Mapping[str, Field]

_TIME: Fields = {'sec': Field('int32'), 'nanosec': Field('uint32')}
_ALWAYS_KNOWN = {'builtin_interfaces/Time': _TIME, 'builtin_interfaces/Duration': _TIME}
# The middleware gives a message without fields one byte, so that it is not empty.
_EMPTY: Fields = {'structure_needs_at_least_one_member': Field('uint8')}


@dataclass(frozen=True)
class Definition:
    """The fields of a type and of all types within it, by names such as `std_msgs/Header`."""

    name: str
    types: Mapping[str, Fields]

    @property
    def has_stamp(self) -> bool:
        """Whether its messages begin with a header, and this with a stamp."""
        first = next(iter(self.types[self.name].values()))
        stamp = next(iter(self.types.get('std_msgs/Header', {}).values()), None)
        return first == Field('std_msgs/Header') and stamp == Field('builtin_interfaces/Time')


@cache
def text_definition(type_name: str, text: str) -> Definition:
    """Return the definition of `type_name` in a `ros2msg` text; raises `DefinitionError`."""
    first, *others = _DELIMITER.split(text)
    name = _short(type_name)
    types = {**_ALWAYS_KNOWN, name: _fields(first, name)}
    for part in others:
        match = _PART_NAME.match(part)
        if match is None:
            raise DefinitionError(f'a part of the definition of {type_name} has no name (`MSG: ...`)')
        inner = _short(match[1])
        if inner not in types or inner in _ALWAYS_KNOWN:
            types[inner] = _fields(part[match.end() :], inner)
    kinds = (field.kind for fields in types.values() for field in fields.values())
    for kind in kinds:
        if '/' in kind and kind not in types:
            raise DefinitionError(f'the definition of {name} does not say what {kind} is')
    return Definition(name, types)


@cache
def installed_definition(type_name: str) -> Definition:
    """Return the definition of an installed type; raises `ValueError` if there is none."""
    return text_definition(type_name, schema_text(type_name))


def definition_of(type_name: str, text: bytes, encoding: str) -> tuple[Definition | None, str]:
    """Return the definition in a recording, or the installed one and a sentence why that one is used."""
    obstacle = ''
    if text.strip() and encoding != 'ros2msg':
        obstacle = f'its definition is written in {encoding!r}, not in ros2msg'
    elif text.strip():
        try:
            return text_definition(type_name, text.decode()), ''
        except (DefinitionError, UnicodeDecodeError) as error:
            obstacle = f'the definition of {type_name} in the recording is not readable ({error})'
    try:
        return installed_definition(type_name), obstacle
    except ValueError:
        if obstacle:
            return None, f'{obstacle}, and the type is not installed'
        return None, f'type {type_name!r} is not installed and the recording does not define it'


def _fields(text: str, owner: str) -> Fields:
    fields = {}
    for line in text.splitlines():
        content = line.split('#')[0].strip()
        if not content:
            continue
        match = _FIELD.fullmatch(content)
        if match is None:
            raise DefinitionError(f'the definition of {owner} has a line that is no field: {content[:60]!r}')
        kind, _, array, name, is_constant = match.groups()
        if not is_constant:
            fields[name] = Field(_kind(kind, owner), _length(array) if array else None)
    return fields or _EMPTY


def _kind(kind: str, owner: str) -> str:
    if kind in NUMBERS or kind in (STRING, 'wstring'):
        return kind
    if kind == 'Header':
        return 'std_msgs/Header'
    return _short(kind) if '/' in kind else f'{owner.split("/")[0]}/{kind}'


def _length(array: str) -> int:
    match = _ARRAY.fullmatch(array)
    if match is None or (match[1] and match[2]):
        raise DefinitionError(f'an array of the length {array} is not understood')
    return int(match[2]) if match[2] else -1


def _short(type_name: str) -> str:
    package, _, kind = type_name.partition('/')
    return f'{package}/{kind.removeprefix("msg/")}'
