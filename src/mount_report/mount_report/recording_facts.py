"""What one recording is and holds: session, versions, parameters, topics, gap, losses."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mount_bags.audit.audit import TopicAudit, audit
from mount_bags.audit.losses import Losses, losses
from mount_bags.bag.recording import Recording
from mount_bags.events.event_marks import read_marks
from mount_bags.run.screen import Table
from mount_bags.run.session import session_parameters
from mount_bags.run.versions import version_differences, versions
from mount_bringup.settings import defaults_of_nodes
from mount_models.specimen import default_specimen
from mount_report.listing import duration_of, started_of, told_session
from mount_ros.topics import AIR_GAP, EVENT

_OF_THE_RUN = {'uri', 'lockstep', 'interface', 'channel', 'port'}
"""Parameters that a run chooses by itself."""


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
    replay = session.get('replay')
    told = (replay if isinstance(replay, Mapping) else session).get('versions')
    audits = audit(recording)
    return RecordingFacts(
        recording,
        session,
        changed_parameters(session_parameters(session)),
        {str(name): str(value) for name, value in told.items()} if isinstance(told, Mapping) else {},
        version_differences(session, versions()) if session else {},
        _gaps(recording),
        _marks(recording),
        audits,
        losses(recording, audits),
    )


def changed_parameters(parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, tuple[Any, Any]]]:
    """Return {node: {parameter: (value, default)}} of what a session tells that is not the default.

    Of friction and contact the default is what the shipped specimen says of this actuator.
    """
    defaults = defaults_of_nodes()
    identified = default_specimen().friction
    control = defaults['mount_control']
    for name in control:
        prefix, _, rest = name.partition('.')
        if prefix in ('friction', 'contact') and rest in identified:
            control[name] = identified[rest]
    changed = {
        node: {
            name: (value, defaults[node][name])
            for name, value in values.items()
            if name in defaults.get(node, {})
            and name not in _OF_THE_RUN
            and _differs(value, defaults[node][name])
        }
        for node, values in parameters.items()
    }
    return {node: own for node, own in changed.items() if own}


def _differs(value: Any, default: Any) -> bool:
    both_unknown = value != value and default != default
    if isinstance(default, tuple):
        return bool(value) and tuple(value) != default
    return not both_unknown and value != default


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
