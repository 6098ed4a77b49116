"""What fields a message has: from the definition that stands in a recording, or from the installed type.

The definition in the recording counts: it is the one that the messages were written with. Field types are
spelled as the installed classes spell them: `double`, `double[9]`, `sequence<double, 3>`, `string<10>`,
`std_msgs/Header`. All types of this project are read in 0.3 ms (measured); rosbags, which the car does not
have, needs 8 ms.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from mount_ros.messages.types import message_class

Fields = Mapping[str, str]

_TYPE_NAME = re.compile(r'[A-Za-z]\w*/msg/[A-Za-z]\w*')
_DELIMITER = re.compile(r'^={80}\s*$', re.MULTILINE)
_PART_NAME = re.compile(r'\s*MSG:\s*([\w/]+)[ \t]*\n?')
_FIELD = re.compile(r'([A-Za-z][\w/]*)(<=\d+)?(\[[^\]]*\])?[ \t]+([A-Za-z]\w*)[ \t]*(=)?.*')
_BOUND = re.compile(r'\[<=(\d+)\]')
_LENGTH = re.compile(r'\[(\d+)\]')
_ELEMENT = re.compile(r'sequence<(.+?)(?:, \d+)?>|(.+)\[\d+\]')
_PRIMITIVES = {
    'bool': 'boolean',
    'byte': 'octet',
    'char': 'uint8',
    'float32': 'float',
    'float64': 'double',
    'string': 'string',
    'wstring': 'wstring',
    **{name: name for bits in (8, 16, 32, 64) for name in (f'int{bits}', f'uint{bits}')},
}
_TIME: Fields = {'sec': 'int32', 'nanosec': 'uint32'}
_ALWAYS_KNOWN = {'builtin_interfaces/Time': _TIME, 'builtin_interfaces/Duration': _TIME}
# The middleware gives a message without fields one byte, so that it is not empty.
_EMPTY: Fields = {'structure_needs_at_least_one_member': 'uint8'}


class DefinitionError(ValueError):
    """A message definition is not understood; the text says what of it."""


@dataclass(frozen=True)
class Definition:
    """The fields of a type and of all types within it, by names such as `std_msgs/Header`."""

    name: str
    types: Mapping[str, Fields]

    @property
    def fields(self) -> Fields:
        """The fields of the type itself."""
        return self.types[self.name]


@cache
def text_definition(type_name: str, text: str) -> Definition:
    """Return the definition of `type_name` in a `ros2msg` text; raises `DefinitionError`."""
    first, *others = _DELIMITER.split(text)
    name = _short(type_name)
    types = {name: _fields(first, name)}
    for part in others:
        match = _PART_NAME.match(part)
        if match is None:
            raise DefinitionError(f'a part of the definition of {type_name} has no name (`MSG: ...`)')
        inner = _short(match[1])
        types.setdefault(inner, _fields(part[match.end() :], inner))
    return Definition(name, _reached(name, {**_ALWAYS_KNOWN, **types}))


@cache
def installed_definition(type_name: str) -> Definition:
    """Return the definition of an installed type; raises `ValueError` if there is none."""
    types: dict[str, Fields] = {}
    if not _TYPE_NAME.fullmatch(type_name):
        raise ValueError(f'{type_name!r} is no message type')
    _add_installed(_short(type_name), message_class(type_name), types)
    return Definition(_short(type_name), types)


@cache
def element_of(field_type: str) -> str:
    """Return the type of the elements of a sequence or an array, any other type as it is."""
    match = _ELEMENT.fullmatch(field_type)
    return (match[1] or match[2]) if match else field_type


def _fields(text: str, owner: str) -> Fields:
    fields = {}
    for line in text.splitlines():
        content = line.split('#')[0].strip()
        if not content:
            continue
        match = _FIELD.fullmatch(content)
        if match is None:
            raise DefinitionError(f'the definition of {owner} has a line that is no field: {content[:60]!r}')
        kind, bound, array, name, is_constant = match.groups()
        if not is_constant:
            fields[name] = _in_array(_kind(kind, bound, owner), array or '')
    return fields or _EMPTY


def _kind(kind: str, bound: str | None, owner: str) -> str:
    primitive = _PRIMITIVES.get(kind)
    if primitive is not None:
        return f'{primitive}<{bound[2:]}>' if bound else primitive
    if kind == 'Header':
        return 'std_msgs/Header'
    return _short(kind) if '/' in kind else f'{owner.split("/")[0]}/{kind}'


def _in_array(kind: str, array: str) -> str:
    if not array:
        return kind
    if array == '[]':
        return f'sequence<{kind}>'
    if match := _BOUND.fullmatch(array):
        return f'sequence<{kind}, {match[1]}>'
    if match := _LENGTH.fullmatch(array):
        return f'{kind}[{match[1]}]'
    raise DefinitionError(f'an array of the length {array} is not understood')


def _reached(name: str, types: Mapping[str, Fields]) -> dict[str, Fields]:
    """Return what `name` needs of `types`; raises `DefinitionError` if something is missing."""
    needed: dict[str, Fields] = {}
    waiting = [name]
    while waiting:
        kind = waiting.pop()
        if kind in needed:
            continue
        if kind not in types:
            raise DefinitionError(f'the definition of {name} does not say what {kind} is')
        needed[kind] = types[kind]
        waiting += [inner for inner in map(element_of, types[kind].values()) if '/' in inner]
    return needed


def _add_installed(name: str, kind: type, types: dict[str, Fields]) -> None:
    fields = dict(kind.get_fields_and_field_types())  # type: ignore[attr-defined]
    types[name] = fields or _EMPTY
    for inner in {element_of(field_type) for field_type in fields.values()}:
        if '/' in inner and inner not in types:
            package, _, short = inner.partition('/')
            _add_installed(inner, message_class(f'{package}/msg/{short}'), types)


def _short(type_name: str) -> str:
    package, _, kind = type_name.partition('/')
    return f'{package}/{kind.removeprefix("msg/")}'
