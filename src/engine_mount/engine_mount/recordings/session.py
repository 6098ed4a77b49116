"""The session of a recording, YAML on the topic `session`: read, and compared with another.

Its keys are `scenario`, `mode`, `started`, `parameters` (by node) and `versions`; of a replay also `replay`.
"""

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.sampling import HIGHEST_SAMPLE_RATE, LOWEST_SAMPLE_RATE, SAMPLE_RATE
from mount_recorder.topic_groups import registered_topic
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


_OF_THE_MOMENT = re.compile(r'started|.*\.(uri|port)')  # differs from run to run and explains nothing
_LISTED = 3  # parameters that only one names


def session_differences(a: str, b: str) -> list[str]:
    """Return a sentence for each difference of two sessions (YAML texts), changed values first."""
    one, other = session_values(a), session_values(b)
    changed = [
        f'{name} is {_shown(one[name])} in A, {_shown(other[name])} in B'
        for name in one
        if name in other and not _same(one[name], other[name]) and not _OF_THE_MOMENT.fullmatch(name)
    ]
    return [*changed, *_only('A', one, other), *_only('B', other, one)]


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


def told_session(recording: Recording) -> dict[str, Any]:
    """Return the content of the session, of several mounts that of the first, {} where none can be read."""
    try:
        text = recorded_session(recording) or next(iter(recorded_sessions(recording).values()), '')
        return session_content(text)
    except (SessionError, SeriesError, ReadingError):
        return {}


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
    """Return the versions with which a recording was made, {} where its session tells none."""
    replay = content.get('replay')
    known = (replay if isinstance(replay, Mapping) else content).get('versions')
    return {str(name): str(value) for name, value in known.items()} if isinstance(known, Mapping) else {}


def version_differences(session: Mapping[str, Any], here: Mapping[str, str]) -> dict[str, str | None]:
    """Return {what: recorded version} of all that is another one here, None where the session does not tell.

    A recorded replay has its own versions beside those of the drive; its answers are of its own.
    """
    replay = session.get('replay')
    recorded = (replay if isinstance(replay, Mapping) else session).get('versions')
    known = recorded if isinstance(recorded, Mapping) else {}
    versions = {name: str(known[name]) if name in known else None for name in here}
    return {name: version for name, version in versions.items() if version != here[name]}


def versions_sentence(differences: Mapping[str, str | None], here: Mapping[str, str]) -> str:
    """Return the sentence about what `version_differences` found."""
    if not differences:
        return 'the recording was made with the same versions on the same kind of processor'
    others = [f'{name} {old} (here {here[name]})' for name, old in differences.items() if old is not None]
    untold = [name for name, old in differences.items() if old is None]
    if len(untold) == len(here):
        return 'the recording does not tell with which versions and on which processor it was made'
    text = 'the recording was made with '
    text += f'others than here: {", ".join(others)}' if others else 'the same versions as far as it tells'
    return text + (f'; it does not tell {", ".join(untold)}' if untold else '')
