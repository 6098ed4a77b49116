"""YAML that people or other programs wrote, as plain data: the one way to read it.

Scanner, parser and the rules of scalars are PyYAML's. What changes a meaning unseen (a key twice) or costs
time without bound (references to references, numbers of a million digits, nesting) is refused, with its line.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

LONGEST_TEXT = 1 << 20
"""Characters, chosen: the `metadata.yaml` of a recording of 1000 files has a quarter of it."""
MOST_PARTS = 500_000
"""Values in a document, references written out; chosen: more than a text of that length holds."""
DEEPEST = 40
"""Lists and mappings one inside another, chosen: no file of this project has more than 8."""
_LONGEST_FILE = 4 * LONGEST_TEXT  # bytes: UTF-8 takes up to four for a character
_LONGEST_NUMBER = 400  # characters, chosen: 309 are the digits of the largest double
_WHOLE_NUMBERS = 1 << 63  # the range of an int64, in which every number of a message lies
_TAG = 'tag:yaml.org,2002:'
_NUMBERS = (_TAG + 'int', _TAG + 'float')
_SCALARS = (*_NUMBERS, _TAG + 'str', _TAG + 'bool', _TAG + 'null', _TAG + 'timestamp')
# The same rules in C, many times as fast.
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class YamlError(ValueError):
    """A text is not YAML as it is read here; the text says where, why and the remedy."""


def yaml_in_file(path: Path) -> Any:
    """Return the content of a file as `plain_yaml` does; raises `YamlError`, also where it cannot be read."""
    return plain_yaml(text_of_file(path))


def text_of_file(path: Path) -> str:
    """Return the text of a file that may be YAML; raises `YamlError` where it cannot be one."""
    try:
        with path.open('rb') as file:
            content = file.read(_LONGEST_FILE + 1)
        if len(content) > _LONGEST_FILE:
            raise YamlError(f'is longer than {_LONGEST_FILE} bytes; give a shorter file')
        return content.decode('utf-8-sig')
    except OSError as error:
        raise YamlError(f'cannot be read ({error.strerror}); give its full path') from error
    except UnicodeDecodeError as error:
        raise YamlError(f'is no text (byte {error.start} is not UTF-8); give a file of text') from error


def plain_yaml(text: str, *, words: bool = False) -> Any:
    """Return the one document in `text`, None of an empty one; raises `YamlError`.

    With `words` every value is the text that stands there.
    """
    if len(text) > LONGEST_TEXT:
        raise YamlError(f'is longer than {LONGEST_TEXT} characters; give a shorter text')
    try:
        return _Reader(text, words).document()
    except yaml.YAMLError as error:
        reason = getattr(error, 'problem', None) or str(error).splitlines()[0]
        mark = getattr(error, 'problem_mark', None)
        place = f' in line {mark.line + 1}' if mark else ''
        raise YamlError(f'is not valid YAML{place}: {reason}') from error
    except UnicodeError as error:
        raise YamlError(f'is not valid YAML: {error}') from error  # a character that cannot be encoded


def excerpt(value: Any) -> str:
    """Return a value as a refusal shows it: whole, or its kind and its beginning."""
    return repr(value) if len(repr(value)) < 60 else f'{type(value).__name__} {repr(value)[:50]}...'


class _Rules(SafeConstructor, Resolver):
    """What PyYAML takes a scalar for."""


class _Reader:
    """Makes plain data of the events of PyYAML's parser."""

    def __init__(self, text: str, words: bool):
        self._loader, self._rules, self._words = _LOADER(text), _Rules(), words
        self._parts = 0
        self._anchors: dict[str, tuple[Any, int]] = {}

    def document(self) -> Any:
        self._loader.get_event()  # the begin of the stream
        if isinstance(self._loader.get_event(), yaml.StreamEndEvent):
            return None
        content = self._value(self._loader.get_event(), 0)
        self._loader.get_event()  # the end of the document
        if not isinstance(behind := self._loader.get_event(), yaml.StreamEndEvent):
            raise _refused(behind, 'a second document begins; leave the first alone')
        return content

    def _value(self, event: Any, depth: int) -> Any:
        before = self._parts
        self._parts += 1
        if depth > DEEPEST:
            raise _refused(event, f'is nested deeper than {DEEPEST} levels')
        if isinstance(event, yaml.ScalarEvent):
            value = event.value if self._words else self._scalar(event)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise _refused(event, f'*{event.anchor} refers to nothing before it; write the value')
            value, parts = self._anchors[event.anchor]
            self._parts += parts
        elif event.tag not in (None, '!', _TAG + 'map', _TAG + 'seq'):
            raise _refused(event, f'{event.tag!r} is not known here; leave it out')
        elif isinstance(event, yaml.SequenceStartEvent):
            value = [self._value(part, depth + 1) for part in self._parts_within()]
        else:
            value = {}
            for part in self._parts_within():
                key = self._value(part, depth + 1)
                if not isinstance(key, str):
                    raise _refused(part, f'the key {excerpt(key)} is no text; put it in quotes')
                if key in value:
                    raise _refused(part, f'the key {excerpt(key)} stands there twice; keep one of them')
                value[key] = self._value(self._loader.get_event(), depth + 1)
        if self._parts > MOST_PARTS:
            raise _refused(event, f'more than {MOST_PARTS} values, written out')
        if event.anchor is not None:
            self._anchors[event.anchor] = value, self._parts - before
        return value

    def _parts_within(self) -> Iterator[Any]:
        while not isinstance(event := self._loader.get_event(), yaml.CollectionEndEvent):
            yield event

    def _scalar(self, event: Any) -> Any:
        tag, text = event.tag, event.value
        if tag in (None, '!'):
            tag = self._rules.resolve(yaml.ScalarNode, text, event.implicit)
        if tag not in _SCALARS:
            raise _refused(event, f'{excerpt(text)} ({tag!r}) is not known here; put it in quotes')
        if tag in _NUMBERS and len(text) > _LONGEST_NUMBER:
            raise _refused(event, f'a number of {len(text)} characters; at most {_LONGEST_NUMBER}')
        try:
            value = _LOADER.yaml_constructors[tag](self._rules, yaml.ScalarNode(tag, text))
        except (ValueError, LookupError) as error:  # a date that is none; `!!int x`, `!!int ''`
            raise _refused(event, f'{excerpt(text)} is no value ({error}); put it in quotes') from error
        if isinstance(value, int) and not -_WHOLE_NUMBERS <= value < _WHOLE_NUMBERS:
            raise _refused(event, f'{excerpt(text)} does not fit into 64 bits; write 1.0e+30 for 1e30')
        return value


def _refused(event: Any, sentence: str) -> YamlError:
    return YamlError(f'is refused in line {event.start_mark.line + 1}: {sentence}')
