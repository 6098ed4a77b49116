"""The session of a recording, what it is, as YAML on the topic `session`, read.

Its keys are `scenario`, `mode`, `started`, `parameters` (by node) and `versions`; of a replay also `replay`.
"""

from collections.abc import Mapping
from typing import Any

from engine_mount.recordings.bag.recording import ReadingError, Recording
from engine_mount.recordings.messages.series import SeriesError
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.sampling import HIGHEST_SAMPLE_RATE, LOWEST_SAMPLE_RATE, SAMPLE_RATE
from mount_recorder.chunk_groups import registered_topic
from mount_ros.topics import SESSION


class SessionError(ValueError):
    """A session message is not understood; the text says why."""


def session_content(text: str) -> dict[str, Any]:
    """Return the content of a session text, {} of an empty one; raises `SessionError`."""
    try:
        content = plain_yaml(text)
    except YamlError as error:
        raise SessionError(f'session {error}') from None
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise SessionError(f'session is a {type(content).__name__} instead of keys with values')
    return content


def session_parameters(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of a session, {} where it tells none."""
    found = content.get('parameters')
    nodes = found.items() if isinstance(found, dict) else ()
    return {str(node): values for node, values in nodes if isinstance(values, dict)}


def session_sample_rate(content: Mapping[str, Any]) -> float:
    """Return the sample rate (Hz) that the nodes of a session had; where it tells none, the default."""
    for values in session_parameters(content).values():
        rate = values.get('sample_rate')
        if isinstance(rate, (int, float)) and LOWEST_SAMPLE_RATE <= rate <= HIGHEST_SAMPLE_RATE:
            return float(rate)
    return SAMPLE_RATE


def session_values(text: str) -> dict[str, Any]:
    """Return {name: value} of a session text; parameters are named as `--set` names them."""
    try:
        return _flat(plain_yaml(text))
    except YamlError:
        return {'text': text}


def recorded_sessions(recording: Recording) -> dict[str, str]:
    """Return the last session text by topic, for each mount has its own."""
    return {
        name: recording.latched(name).data
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is SESSION and len(recording[name])
    }


def recorded_session(recording: Recording) -> str:
    """Return the last session text of a recording, empty where it has none or those of several mounts."""
    found = recorded_sessions(recording)
    only = next(iter(found.values())) if len(found) == 1 else ''
    return found.get(f'/{SESSION.name}', only)


def recorded_sample_rate(recording: Recording, namespace: str = '/') -> float:
    """Return the sample rate (Hz) of the mount in `namespace`; where no session tells it, the default."""
    try:
        found = recorded_sessions(recording)
        text = found.get(f'{namespace}{SESSION.name}') or recorded_session(recording)
        return session_sample_rate(session_content(text))
    except (SessionError, ReadingError, SeriesError):
        return SAMPLE_RATE


def _flat(content: Any, prefix: str = '') -> dict[str, Any]:
    """Return {path: value}; the common root of all parameters is left out."""
    if not isinstance(content, Mapping):
        return {prefix or 'text': content} if content is not None else {}
    flat: dict[str, Any] = {}
    for key, value in content.items():
        root = '' if not prefix and key == 'parameters' else f'{prefix}.{key}' if prefix else str(key)
        flat.update(_flat(value, root) if isinstance(value, Mapping) else {root: value})
    return flat
