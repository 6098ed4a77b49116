"""The last verdicts of the nodes, what was measured once, and what has happened."""

import math
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from engine_mount.recordings.layout import decode, installed_definition
from engine_mount.recordings.session import SessionError, session_content, session_parameters
from engine_mount.view.feed import Message
from mount_recorder.automatic_marks import MarkKind
from mount_ros.messages.event import Mark, read_mark
from mount_ros.messages.verdicts import verdicts_in
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, DIAGNOSTICS, EVENT, SESSION

_EVENTS = 12  # chosen: the last ones
_OTHER_CLOCK = 86_400.0  # s, chosen: a stamp so far off is of another clock
_SILENT = 3_000_000_000  # ns, chosen: a node without diagnostics for so long is not there
_LEVELS = ('ok', 'warning', 'error')
_FIGURES = {
    'wear reserve': ('mount_init', 'wear_reserve_um', ' µm'),
    'policy': ('mount_control', 'policy', ''),
    'samples': ('mount_driver', 'samples', ''),
    **{
        f'CAN {name.replace("_", " ")}': ('mount_driver', name, '')
        for name in (
            'lost',
            'corrupt',
            'late',
            'resent',
            'wrong_sequence',
            'error_frames',
            'refused',
            'setpoint_timeouts',
        )
    },
    'bridged': ('mount_control', 'bridged', ''),
    'recorded messages': ('mount_recorder', 'kept', ''),
    'not recorded': ('mount_recorder', 'lost', ''),
}
"""{name: (node, figure of its diagnostics, unit)}."""


class NodeState(NamedTuple):
    """The last verdict of a node: level as in `diagnostic_msgs`, a sentence, figures, and when (ns)."""

    level: int
    sentence: str
    figures: dict[str, str]
    received: int


_UNKNOWN = NodeState(0, '', {}, 0)


@dataclass
class GraphState:
    """Everything about the graph that is no trace; `take` keeps it up to date."""

    namespace: str = ''
    zero: int | None = None  # the stamp (ns) at which time begins
    time: float = 0.0  # s, of the last sample
    nodes: dict[str, NodeState] = field(default_factory=dict)
    gap: dict[str, float] = field(default_factory=dict)
    coil_celsius: float = math.nan
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    events: deque[tuple[float, Mark]] = field(default_factory=lambda: deque(maxlen=_EVENTS))

    def take(self, message: Message) -> None:
        """Take a message of a topic that tells of state, and no other."""
        if message.topic is DIAGNOSTICS:
            self._take_diagnostics(message)
        elif message.topic is AIR_GAP:
            content = _decoded(message)
            self.gap = dict(zip(content.name, map(float, content.position), strict=False))
        elif message.topic is COIL_TEMPERATURE:
            self.coil_celsius = float(_decoded(message).temperature)
        elif message.topic is EVENT:
            mark = read_mark(_decoded(message).data, message.received)
            if mark.kind != MarkKind.SWITCH_ON.value:  # what is shown here comes from the trace
                self.add(mark, message.received)
        elif message.topic is SESSION:
            with suppress(SessionError):
                self.parameters = session_parameters(session_content(_decoded(message).data))

    def add(self, mark: Mark, received: int) -> None:
        """Add an event, of its own stamp unless that is `received` (ns) or of another clock."""
        time = math.nan if self.zero is None else (mark.time - self.zero) * 1e-9
        own = mark.time != received and abs(time) < _OTHER_CLOCK
        self.events.append((time if own else self.time, mark))

    def values(self) -> dict[str, str]:
        """Return the figures beside the charts, by name, with units."""
        found = {
            f'{name} gap': f'{1e6 * self.gap[key]:.1f} ± {1e6 * self.gap.get(f"{key}_std", math.nan):.1f} µm'
            for name, key in (('rest', 'rest_gap'), ('contact', 'contact_gap'))
            if key in self.gap
        }
        if not math.isnan(self.coil_celsius):
            found['coil temperature'] = f'{self.coil_celsius:.1f} °C'
        for name, (node, figure, unit) in _FIGURES.items():
            if node in self.nodes and (text := self.nodes[node].figures.get(figure)):
                found[name] = f'{text}{unit}'
        return found

    def as_json(self, now: int) -> dict[str, Any]:
        """Return all of it, at `now` on the clock of the messages (ns)."""
        nodes = []
        for name, node in sorted(self.nodes.items()):
            silent = now - node.received > _SILENT
            state = node.figures.get('state', '')
            idle = silent or (not node.level and state not in ('', 'active'))
            level = 'idle' if idle else _LEVELS[min(node.level, 2)]
            sentence = 'no diagnostics any more' if silent else node.sentence
            nodes.append({'name': name, 'level': level, 'sentence': sentence, 'state': state})
        events = [
            {'time': round(time, 3), 'kind': mark.kind, 'text': mark.text}
            for time, mark in reversed(self.events)
        ]
        values = [{'name': name, 'value': value} for name, value in self.values().items()]
        return {'nodes': nodes, 'values': values, 'events': events}

    def _take_diagnostics(self, message: Message) -> None:
        for verdict in verdicts_in(_decoded(message)):
            space, _, name = verdict.node.rpartition('/')
            if space != self.namespace.strip('/'):
                continue  # /diagnostics belongs to all mounts of the car
            before = self.nodes.get(name, _UNKNOWN)
            self.nodes[name] = NodeState(verdict.level, verdict.sentence, verdict.figures, message.received)
            if (verdict.level or before.level) and before.sentence != verdict.sentence:
                self.add(Mark(message.received, name, verdict.sentence), message.received)


def _decoded(message: Message) -> Any:
    return decode(message.raw, installed_definition(message.topic.type))
