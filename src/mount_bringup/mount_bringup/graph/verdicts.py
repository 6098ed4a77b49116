"""What the nodes of a graph say of themselves on `/diagnostics`."""

import time
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.liveliness import Liveliness
from mount_bringup.graph.nodes import CONTROL, DRIVER, GraphNode
from mount_ros.messages.event import Mark
from mount_ros.messages.verdicts import Level, flags_of, verdicts_in

_NANOSECONDS = 1_000_000_000


class Witness:
    """Is told what happens in a graph while it happens; this one takes no note of it."""

    def state(self, node: GraphNode, state: str) -> None:
        """Take that a node is `configured`, `activating` or `active` from now on."""

    def told(self, name: str, figures: Mapping[str, str]) -> None:
        """Take what a node of this name tells: its figures, `level` and `sentence`."""

    def mark(self, mount: str, mark: Mark) -> None:
        """Take a mark on the topic `event` of a mount."""


class Verdicts:
    """The last diagnostics of each node in `namespace`, and who has been silent since."""

    def __init__(self, nodes: Sequence[GraphNode], namespace: str):
        self.liveliness = Liveliness()
        self.witness = Witness()
        self._nodes = nodes
        self._names = {node.full_name for node in nodes}
        self._space = f'{namespace.strip("/")}/'.lstrip('/')
        self._figures: dict[str, dict[str, str]] = {}
        self._activated: dict[str, int] = {}  # system clock, ns, as the stamps of diagnostics

    def take(self, message: DiagnosticArray) -> None:
        """Take what a node tells."""
        sent = message.header.stamp.sec * _NANOSECONDS + message.header.stamp.nanosec
        for told in verdicts_in(message):
            # /diagnostics belongs to all mounts of the car
            if not told.node.startswith(self._space):
                continue
            name = told.node.removeprefix(self._space)
            if '/' in name and name not in self._names:
                continue
            if name in self._names:
                self.liveliness.hear(name, time.monotonic())
            self._figures[name] = {
                **told.figures,
                'level': str(told.level),
                'sentence': told.sentence,
            }
            if sent < self._activated.get(name, 0):
                self._figures[name]['state'] = 'active'  # it was under way when the node was activated
            if name in self._names:
                self.witness.told(name, self._figures[name])

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return what a node told last: its figures, `level` and `sentence`; empty if nothing came."""
        return self._figures.get(node.full_name, {})

    def note_active(self, node: GraphNode) -> None:
        """Note that a node was activated, which it tells only with its next diagnostics."""
        self._activated[node.full_name] = time.time_ns()
        self._figures.setdefault(node.full_name, {'level': '0', 'sentence': ''})['state'] = 'active'
        self.witness.state(node, 'active')

    def forget(self, node: GraphNode) -> None:
        """Forget what a node has told: it holds no more."""
        self._figures.pop(node.full_name, None)
        self._activated.pop(node.full_name, None)
        self.liveliness.forget(node.full_name)

    def check_fatal(self) -> None:
        """Raise `GraphError` if a node tells that the graph must end."""
        for node in self._nodes:
            figures = self.figures(node)
            if flags_of(figures).fatal:
                raise GraphError(f'{node.full_name}: {figures["sentence"]}{self._who_is_silent(figures)}')

    def needing_initialisation(self) -> str:
        """Return why the mount must be initialised anew, by the node that says so; else empty."""
        for node in self._nodes:
            figures = self.figures(node)
            if flags_of(figures).needs_initialisation:
                return f'{node.full_name}: {figures["sentence"]}'
        return ''

    def complaints(self) -> str:
        """Return what the nodes complain of, in one sentence."""
        said = [
            f'{name}: {figures["sentence"]}'
            for name, figures in self._figures.items()
            if int(figures['level']) >= Level.WARN
        ]
        return '; '.join(said) or 'no node complains'

    def _who_is_silent(self, figures: dict[str, str]) -> str:
        """Return the first node of the chain that has not handled the sample which waits for its answer."""
        waiting = figures.get('waiting_stamp', '')
        if not waiting.isdigit():
            return ''
        for node in self._nodes:
            handled = self.figures(node).get('last_stamp', '')
            if node.is_a(DRIVER, CONTROL) and (not handled.isdigit() or int(handled) < int(waiting)):
                return f'; {node.full_name} does not answer'
        return ''
