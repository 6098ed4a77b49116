"""YAML that people or other programs wrote, as plain data: the one way to read it.

Scanner, parser and the rules of scalars are PyYAML's. What changes a meaning unseen (a key twice) or costs
time without bound (references to references, numbers of a million digits, nesting) is refused, with its line.
"""

import functools
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
_SHORT = 100  # characters, chosen: of scalars that are remembered; nearly all are shorter
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
        return _Composition(text, words).document()
    except yaml.YAMLError as error:
        reason = getattr(error, 'problem', None) or str(error).splitlines()[0]
        raise YamlError(
            f'is not valid YAML{_place(getattr(error, "problem_mark", None))}: {reason}'
        ) from error
    except ValueError as error:
        if isinstance(error, YamlError):
            raise
        raise YamlError(f'is not valid YAML: {error}') from error  # a character that cannot be encoded


def excerpt(value: Any) -> str:
    """Return a value as a refusal shows it: whole, or its kind and its beginning."""
    return repr(value) if len(repr(value)) < 60 else f'{type(value).__name__} {repr(value)[:50]}...'


class _Open:
    """A list or mapping whose end has not come."""

    def __init__(self, content: Any, anchor: str | None):
        self.content, self.anchor = content, anchor
        self.parts = 1
        self.key: str | None = None

    def add(self, value: Any, parts: int, event: Any) -> None:
        self.parts += parts
        if isinstance(self.content, list):
            self.content.append(value)
        elif self.key is not None:
            self.content[self.key] = value
            self.key = None
        elif not isinstance(value, str):
            raise _refused(event, f'the key {excerpt(value)} is no text; put it in quotes')
        elif value in self.content:
            raise _refused(event, f'the key {excerpt(value)} stands there twice; keep one of them')
        else:
            self.key = value


class _Composition:
    """Puts one document together from the events of PyYAML's parser."""

    def __init__(self, text: str, words: bool):
        self._loader = _LOADER(text)
        self._words = words
        self._open = [_Open([], None)]
        self._anchors: dict[str, tuple[Any, int]] = {}

    def document(self) -> Any:
        try:
            while not isinstance(event := self._loader.get_event(), yaml.StreamEndEvent):
                self._take(event)
        finally:
            self._loader.dispose()
        documents = self._open[0].content
        if len(documents) > 1:
            raise YamlError(f'has {len(documents)} documents; leave the first alone')
        return documents[0] if documents else None

    def _take(self, event: Any) -> None:
        if isinstance(event, yaml.ScalarEvent):
            self._close(event, self._scalar(event), 1, event.anchor)
        elif isinstance(event, yaml.CollectionStartEvent):
            if event.tag not in (None, '!', _TAG + 'map', _TAG + 'seq'):
                raise _refused(event, f'{event.tag!r} is not known here; leave it out')
            if len(self._open) > DEEPEST:
                raise _refused(event, f'is nested deeper than {DEEPEST} levels')
            self._open.append(_Open({} if isinstance(event, yaml.MappingStartEvent) else [], event.anchor))
        elif isinstance(event, yaml.CollectionEndEvent):
            ended = self._open.pop()
            self._close(event, ended.content, ended.parts, ended.anchor)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise _refused(event, f'*{event.anchor} refers to nothing before it; write the value')
            self._close(event, *self._anchors[event.anchor], None)

    def _close(self, event: Any, value: Any, parts: int, anchor: str | None) -> None:
        if anchor is not None:
            self._anchors[anchor] = value, parts
        self._open[-1].add(value, parts, event)
        if self._open[-1].parts > MOST_PARTS:
            raise _refused(event, f'more than {MOST_PARTS} values, written out')

    def _scalar(self, event: Any) -> Any:
        if self._words:
            return event.value
        value_of = _short_value if len(event.value) <= _SHORT else _value
        try:
            return value_of(event.tag, event.value, event.implicit)
        except ValueError as error:
            raise _refused(event, str(error)) from error


class _Rules(SafeConstructor, Resolver):
    """What PyYAML takes a scalar for, apart from the text in which it stands."""


def _value(tag: str | None, text: str, implicit: tuple[bool, bool]) -> Any:
    """Return what a scalar means, which depends on nothing else; raises `ValueError` with the remedy."""
    rules = _Rules()
    if tag is None or tag == '!':
        tag = rules.resolve(yaml.ScalarNode, text, implicit)
    if tag not in _SCALARS:
        raise ValueError(f'{excerpt(text)} ({tag!r}) is not known here; put it in quotes')
    if tag in _NUMBERS and len(text) > _LONGEST_NUMBER:
        raise ValueError(f'a number of {len(text)} characters; at most {_LONGEST_NUMBER}')
    try:
        value = _LOADER.yaml_constructors[tag](rules, yaml.ScalarNode(tag, text))
    except (ValueError, LookupError) as error:  # a date that is none; `!!int x`, `!!int ''`
        raise ValueError(f'{excerpt(text)} is no value ({error}); put it in quotes') from error
    if isinstance(value, int) and not -_WHOLE_NUMBERS <= value < _WHOLE_NUMBERS:
        raise ValueError(f'{excerpt(text)} does not fit into 64 bits; write 1.0e+30 for 1e30')
    return value


# Recordings tell the same names and parameters again and again; what is returned cannot be changed.
_short_value = functools.lru_cache(maxsize=4096)(_value)


def _refused(event: Any, sentence: str) -> YamlError:
    return YamlError(f'is refused{_place(event.start_mark)}: {sentence}')


def _place(mark: Any) -> str:
    return '' if mark is None else f' in line {mark.line + 1}'
