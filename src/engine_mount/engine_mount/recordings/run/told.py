"""What a recording tells of its run in its session and at the ends of its files."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from engine_mount.recordings.bag.recording import ReadingError, Recording
from engine_mount.recordings.messages.series import SeriesError
from engine_mount.recordings.run.session import (
    SessionError,
    recorded_session,
    recorded_sessions,
    session_content,
    session_sample_rate,
)


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
    told = (replay if isinstance(replay, Mapping) else content).get('versions')
    return {str(name): str(value) for name, value in told.items()} if isinstance(told, Mapping) else {}
