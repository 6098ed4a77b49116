"""How two sessions differ, in words: parameters, versions, scenario. Usually the reason of all else."""

import re
from collections.abc import Mapping
from typing import Any

import yaml

from mount_bags.bag.recording import Recording
from mount_bags.messages.series import registered_topic
from mount_ros.topics import SESSION

_OF_THE_MOMENT = re.compile(r'started|.*\.(uri|port)')  # differs from run to run and explains nothing
_LISTED = 3  # parameters that only one names


def session_texts(recording: Recording) -> dict[str, str]:
    """Return the last session message by topic, for each mount has its own."""
    return {
        name: recording.latched(name).data
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is SESSION and len(recording[name])
    }


def session_text(recording: Recording) -> str:
    """Return the last session message of a recording, empty where it has none or those of several mounts."""
    found = session_texts(recording)
    only = next(iter(found.values())) if len(found) == 1 else ''
    return found.get(f'/{SESSION.name}', only)


def session_differences(a: str, b: str) -> list[str]:
    """Return a sentence for each difference of two sessions (YAML texts), changed values first."""
    one, other = session_values(a), session_values(b)
    changed = [
        f'{name} is {_shown(one[name])} in A, {_shown(other[name])} in B'
        for name in one
        if name in other and not _same(one[name], other[name]) and not _OF_THE_MOMENT.fullmatch(name)
    ]
    return [*changed, *_only('A', one, other), *_only('B', other, one)]


def session_values(text: str) -> dict[str, Any]:
    """Return {name: value} of a session (YAML text); parameters are named as `--set` names them."""
    return _flat(_content(text))


def _content(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return {'text': text}


def _flat(content: Any, prefix: str = '') -> dict[str, Any]:
    """Return {path: value}; the common root of all parameters is left out."""
    if not isinstance(content, Mapping):
        return {prefix or 'text': content} if content is not None else {}
    flat: dict[str, Any] = {}
    for key, value in content.items():
        root = '' if not prefix and key == 'parameters' else f'{prefix}.{key}' if prefix else str(key)
        flat.update(_flat(value, root) if isinstance(value, Mapping) else {root: value})
    return flat


def _same(one: Any, other: Any) -> bool:
    both_unknown = isinstance(one, float) and isinstance(other, float) and one != one and other != other
    return both_unknown or one == other


def _only(where: str, present: Mapping[str, Any], absent: Mapping[str, Any]) -> list[str]:
    names = [name for name in present if name not in absent and not _OF_THE_MOMENT.fullmatch(name)]
    if not names:
        return []
    shown = ', '.join(f'{name} ({_shown(present[name])})' for name in names[:_LISTED])
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    return [f'only {where} tells {shown}{more}']


def _shown(value: Any) -> str:
    return f'{value:g}' if isinstance(value, float) else str(value)
