"""What one recording is and holds: session, versions, parameters, topics, gap, losses."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from engine_mount.recordings.audit import TopicAudit, audit
from engine_mount.recordings.events import read_marks
from engine_mount.recordings.losses import Losses, losses
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Table
from engine_mount.recordings.session import (
    duration_of,
    session_parameters,
    started_of,
    told_session,
    version_differences,
    versions_told,
)
from engine_mount.settings.changes import changed_parameters
from mount_recorder.versions import versions
from mount_ros.topics import AIR_GAP, EVENT


@dataclass(frozen=True)
class RecordingFacts:
    """One recording; `changed` is {node: {parameter: (value, default)}}, gaps are in m."""

    recording: Recording
    session: dict[str, Any]
    changed: dict[str, dict[str, tuple[Any, Any]]]
    versions: dict[str, str]  # with which it was made, where the session tells
    others: dict[str, str | None]  # of these what is another one here
    gaps: dict[str, dict[str, float]]  # by mount
    marks: dict[str, int]  # how many of each kind
    audits: Mapping[str, TopicAudit]
    losses: Losses

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON knows it: unknown is null."""
        started = started_of(self.session, self.recording)
        told = {name: self.session.get(name) for name in ('scenario', 'mode')}
        return {
            'recording': str(self.recording.path),
            'started': started.isoformat() if started else None,
            'duration_s': duration_of(self.session, self.recording),
            **told,
            'replay': 'replay' in self.session,
            'mounts': [mount for mount in self.recording.mounts if mount],
            'whole': self.recording.whole,
            'versions': self.versions,
            'changed_parameters': {
                node: {
                    name: {'value': _plain(value), 'default': _plain(default)}
                    for name, (value, default) in own.items()
                }
                for node, own in self.changed.items()
            },
            'gaps': {
                mount: {name: _plain(value) for name, value in gap.items()}
                for mount, gap in self.gaps.items()
            },
            'marks': self.marks,
            'topics': {
                name: {'type': topic.type, 'messages': topic.message_count}
                for name, topic in self.recording.topics.items()
            },
            **self.losses.as_json(),
        }

    def topics_table(self) -> Table:
        """Return the topics with their types, messages, and how many are lost."""
        rows = [
            (
                name,
                topic.type.replace('/msg/', '/'),
                str(topic.message_count),
                '' if (lost := self.audits[name].lost) is None else str(lost),
            )
            for name, topic in self.recording.topics.items()
        ]
        return Table('Topics', 'llrr', rows, ('topic', 'type', 'messages', 'lost'))

    def parameters_table(self) -> Table:
        """Return the parameters that were not at their defaults."""
        rows = [
            (f'{node}.{name}', _text(value), _text(default))
            for node, own in self.changed.items()
            for name, (value, default) in own.items()
        ]
        return Table('Parameters other than the default', 'lll', rows, ('parameter', 'value', 'default'))


def recording_facts(recording: Recording) -> RecordingFacts:
    """Return what a recording is and holds; every message is looked at, for the losses."""
    session = told_session(recording)
    audits = audit(recording)
    return RecordingFacts(
        recording,
        session,
        changed_parameters(session_parameters(session)),
        versions_told(session),
        version_differences(session, versions()) if session else {},
        _gaps(recording),
        _marks(recording),
        audits,
        losses(recording, audits),
    )


def _gaps(recording: Recording) -> dict[str, dict[str, float]]:
    found = {}
    for part in recording.by_mount():
        if AIR_GAP.name in part and len(part[AIR_GAP.name]):
            message = part.latched(AIR_GAP.name)
            found[part.mount] = dict(zip(message.name, map(float, message.position), strict=True))
    return found


def _marks(recording: Recording) -> dict[str, int]:
    counts: dict[str, int] = {}
    for part in recording.by_mount():
        for mark in read_marks(part[EVENT.name]) if EVENT.name in part else ():
            counts[mark.kind] = counts.get(mark.kind, 0) + 1
    return counts


def _plain(value: Any) -> Any:
    unknown = isinstance(value, float) and value != value
    return None if unknown else list(value) if isinstance(value, tuple) else value


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:g}'
    return ', '.join(map(str, value)) if isinstance(value, (tuple, list)) else str(value)
