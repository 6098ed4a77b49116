"""The text of a message on `event`: "here is something worth finding again", in YAML."""

import contextlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import yaml

from mount_models.plain_yaml import YamlError, plain_yaml

BY_HAND = 'mark'  # kind of a mark that a person set
PARAMETER = 'parameter'  # kind of a mark where parameters of a node at work were changed
_OF_CHANGE = {'node', 'values'}


class Mark(NamedTuple):
    """What happened when: `time` in ns on the clock of the stamps, one word, one sentence."""

    time: int
    kind: str
    text: str = ''


class ParametersChanged(NamedTuple):
    """From the sample of `time` (ns) on `node` works with `values`, {parameter: value}."""

    time: int
    node: str
    values: Mapping[str, Any]


def mark_text(mark: Mark) -> str:
    """Return the text of the message."""
    return _text(mark._asdict())


def read_mark(text: str, received: int) -> Mark:
    """Return the mark that a message holds; what is missing is `received` (ns), `mark` and no text.

    A plain sentence on `event` is allowed: a text with other fields than these three, or without plain values
    of them, is kept whole. Only a change of parameters may have more fields.
    """
    # Every word stays the text that it is: `12:30` is no number, and `2026-02-30` no date.
    content = _content(text, words=True)
    fields = {name: content[name] for name in Mark._fields if isinstance(content.get(name), str)}
    kind = fields.get('kind', BY_HAND)
    others = content.keys() - fields.keys() - (_OF_CHANGE if kind == PARAMETER else set())
    with contextlib.suppress(ValueError):
        received = int(fields.get('time', ''))
    return Mark(received, kind, fields.get('text', '') if fields and not others else text.strip())


def change_text(node: str, changes: Mapping[str, tuple[Any, Any]]) -> str:
    """Return the text on parameters {name: (old, new)} of `node`, all but the moment: see `dated`."""
    told = ', '.join(f'{name} from {old} to {new}' for name, (old, new) in changes.items())
    values = {name: new for name, (_, new) in changes.items()}
    return _text({'kind': PARAMETER, 'text': f'{node}: {told}', 'node': node, 'values': values})


def dated(time: int, text: str) -> str:
    """Return the text of a message on what happens at stamp `time` (ns); cheap, for the path of the data."""
    return f'time: {time}\n{text}'


def read_change(text: str) -> ParametersChanged | None:
    """Return the change of parameters that a message describes, or None."""
    content = _content(text)
    time, node, values = content.get('time'), content.get('node'), content.get('values')
    if content.get('kind') != PARAMETER or not isinstance(values, dict) or not isinstance(node, str):
        return None
    return ParametersChanged(time, node, values) if type(time) is int else None


def _text(content: Mapping[str, Any]) -> str:
    return yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True, width=1 << 20)


def _content(text: str, *, words: bool = False) -> dict[Any, Any]:
    try:
        content = plain_yaml(text, words=words)
    except YamlError:
        return {}
    return content if isinstance(content, dict) else {}
