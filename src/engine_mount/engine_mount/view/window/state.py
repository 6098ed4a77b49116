"""What the nodes say of themselves, what was measured once, and what has happened."""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

from engine_mount.recordings.layout import decode, installed_definition
from engine_mount.recordings.session import SessionError, session_content, session_parameters
from engine_mount.view.feed.feed import Message
from mount_ros.messages.event import read_mark
from mount_ros.messages.verdicts import verdicts_in
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, DIAGNOSTICS, EVENT, SESSION

_EVENTS = 50  # chosen: kept
_SILENT = 3_000_000_000  # ns, chosen: a node that says nothing for so long is not there


@dataclass
class NodeState:
    """The last verdict of a node: level as in `diagnostic_msgs`, a sentence, figures, and when (ns)."""

    level: int
    sentence: str
    figures: dict[str, str]
    told: int


@dataclass
class Happening:
    """Something that happened: time of its stamp (ns), one word, one sentence."""

    time: int
    kind: str
    text: str


@dataclass
class GraphState:
    """Everything about the graph that is no trace; `take` keeps it up to date."""

    namespace: str = ''
    nodes: dict[str, NodeState] = field(default_factory=dict)
    gap: dict[str, float] = field(default_factory=dict)
    coil_celsius: float = float('nan')
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    scenario: str = ''
    events: deque[Happening] = field(default_factory=lambda: deque(maxlen=_EVENTS))

    def take(self, message: Message) -> None:
        """Take a message of a topic that tells of state, and no other."""
        if message.topic is DIAGNOSTICS:
            self._take_diagnostics(message)
        elif message.topic is AIR_GAP:
            content = _decoded(message)
            self.gap = dict(zip(content.name, content.position, strict=False))
        elif message.topic is COIL_TEMPERATURE:
            self.coil_celsius = float(_decoded(message).temperature)
        elif message.topic is EVENT:
            mark = read_mark(_decoded(message).data, message.received)
            self.events.append(Happening(mark.time, mark.kind, mark.text))
        elif message.topic is SESSION:
            self._take_session(_decoded(message).data)

    def figure(self, node: str, name: str) -> str:
        """Return a figure that a node told, empty where it told none."""
        return self.nodes[node].figures.get(name, '') if node in self.nodes else ''

    def silent(self, now: int) -> list[str]:
        """Return the nodes that have said nothing for a while, at `now` on the clock of the messages (ns)."""
        return [name for name, node in self.nodes.items() if now - node.told > _SILENT]

    def _take_diagnostics(self, message: Message) -> None:
        for told in verdicts_in(_decoded(message)):
            space, _, name = told.node.rpartition('/')
            if space != self.namespace.strip('/'):
                continue  # /diagnostics belongs to all mounts of the car
            before = self.nodes.get(name)
            self.nodes[name] = NodeState(told.level, told.sentence, told.figures, message.received)
            if told.level and (before is None or before.sentence != told.sentence):
                self.events.append(Happening(message.received, name, told.sentence))

    def _take_session(self, text: str) -> None:
        try:
            content = session_content(text)
        except SessionError:
            return
        self.parameters = session_parameters(content)
        self.scenario = str(content.get('scenario', ''))


def _decoded(message: Message) -> Any:
    return decode(message.raw, installed_definition(message.topic.type))
