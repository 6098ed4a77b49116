"""The session of a recording, YAML on the topic `session`: read, and compared with another.

Its keys are `scenario`, `mode`, `started`, `parameters` (by node) and `versions`; of a replay also `replay`.
"""

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from engine_mount.recordings.difference import few
from engine_mount.recordings.metadata import registered_topic
from engine_mount.recordings.recording import ReadingError, Recording
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.sampling import HIGHEST_SAMPLE_RATE, LOWEST_SAMPLE_RATE, SAMPLE_RATE
from mount_ros.topics import SESSION

_OF_THE_MOMENT = re.compile(r'started|.*\.(uri|port)')  # differs from run to run and explains nothing
_LISTED = 3  # parameters that only one names


class SessionError(ReadingError):
    """A session message is not understood; the text says why."""


def session_content(text: str) -> dict[str, Any]:
    """Return the content of a session text, {} of an empty one; raises `SessionError`."""
    try:
        content = plain_yaml(text)
    except YamlError as error:
        raise SessionError(f'session {error}') from None
    if content is not None and not isinstance(content, dict):
        raise SessionError(f'session is a {type(content).__name__} instead of keys with values')
    return content or {}


def session_parameters(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of a session, {} where it tells none."""
    return {
        str(node): values
        for node, values in _mapping(content, 'parameters').items()
        if isinstance(values, dict)
    }


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
        content = plain_yaml(text)
    except YamlError:
        content = text
    return _flat(
        content if isinstance(content, Mapping) else {'text': content} if content is not None else {}
    )


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
    except ReadingError:
        return SAMPLE_RATE


def told_session(recording: Recording) -> dict[str, Any]:
    """Return the content of the session, of several mounts that of the first, {} where none can be read."""
    try:
        text = recorded_session(recording) or next(iter(recorded_sessions(recording).values()), '')
        return session_content(text)
    except ReadingError:
        return {}


def session_differences(a: str, b: str) -> list[str]:
    """Return a sentence for each difference of two sessions (YAML texts), changed values first."""
    sessions = [
        {
            name: f'{value:g}' if isinstance(value, float) else str(value)
            for name, value in session_values(text).items()
            if not _OF_THE_MOMENT.fullmatch(name)
        }
        for text in (a, b)
    ]
    one, other = sessions
    found = [
        f'{name} is {text} in A, {other[name]} in B'
        for name, text in one.items()
        if name in other and text != other[name]
    ]
    for where, here, there in (('A', one, other), ('B', other, one)):
        alone = [f'{name} ({text})' for name, text in here.items() if name not in there]
        if alone:
            found.append(f'only {where} tells {few(alone, most=_LISTED)}')
    return found


def started_of(content: Mapping[str, Any], recording: Recording) -> datetime | None:
    """Return when a run began: as its session tells, else when its first message came."""
    try:
        return datetime.fromisoformat(str(content['started'])).astimezone()
    except (KeyError, ValueError):
        times = recording.time_range
    try:
        return datetime.fromtimestamp(times[0] / 1e9).astimezone() if times else None
    except (OverflowError, ValueError, OSError):
        return None


def duration_of(content: Mapping[str, Any], recording: Recording) -> float | None:
    """Return the length in s: of the displacement by its rate, else from the first message to the last."""
    counts = [recording.topics[f'/{mount}/displacement'.replace('//', '/')] for mount in recording.mounts]
    samples = max((topic.message_count for topic in counts), default=0)
    if samples:
        return samples / session_sample_rate(content)
    times = recording.time_range
    return (times[1] - times[0]) / 1e9 if times else None


def versions_told(content: Mapping[str, Any]) -> dict[str, str]:
    """Return the versions with which a recording was made, {} where its session tells none.

    A recorded replay has its own versions beside those of the drive; its answers are of its own.
    """
    source = _mapping(content, 'replay') or content
    return {str(name): str(value) for name, value in _mapping(source, 'versions').items()}


def version_differences(session: Mapping[str, Any], here: Mapping[str, str]) -> dict[str, str | None]:
    """Return {what: recorded version} of what is another one here, None where the session does not tell."""
    known = versions_told(session)
    return {name: known.get(name) for name in here if known.get(name) != here[name]}


def versions_sentence(differences: Mapping[str, str | None], here: Mapping[str, str]) -> str:
    """Return the sentence about what `version_differences` found."""
    others = [f'{name} {old} (here {here[name]})' for name, old in differences.items() if old is not None]
    missing = [name for name, old in differences.items() if old is None]
    if not differences:
        return 'the recording was made with the same versions on the same kind of machine'
    if len(missing) == len(here):
        return 'the recording does not tell with which versions it was made'
    which = f'others than here: {", ".join(others)}' if others else 'the same versions as far as it tells'
    more = f'; it does not tell {", ".join(missing)}' if missing else ''
    return f'the recording was made with {which}{more}'


def _mapping(content: Mapping[str, Any], key: str) -> Mapping[Any, Any]:
    found = content.get(key)
    return found if isinstance(found, Mapping) else {}


def _flat(content: Mapping[Any, Any], prefix: str = '') -> dict[str, Any]:
    """Return {path: value}; the common root of all parameters is left out."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        root = '' if not prefix and key == 'parameters' else f'{prefix}.{key}' if prefix else str(key)
        flat |= _flat(value, root) if isinstance(value, Mapping) else {root or 'text': value}
    return flat
