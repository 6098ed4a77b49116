"""The last report of each node on `/diagnostics`, and the nodes that are silent."""

import time

from diagnostic_msgs.msg import DiagnosticArray

from mount_bringup.graph.nodes import CONTROL, DRIVER, Figures, GraphError, GraphNode, name_in
from mount_ros.messages.event import Mark
from mount_ros.messages.verdicts import flags_of, verdicts_in
from mount_ros.nodes.diagnostics import Level

SILENCE_LIMIT = 4.0
"""Seconds (chosen) without diagnostics, which come once a second, until a node is treated as failed."""
_LONGEST_PAUSE = 0.5  # s, chosen: ten times the period in which the supervisor checks
_LATEST_ARRIVAL = 2.0  # s, chosen: until then a report that was sent before an activation has arrived


class GraphObserver:
    """Receives events of the graph; this one ignores them."""

    def on_state(self, node: GraphNode, state: str) -> None:
        """Receive that a node is `configured`, `activating` or `active` from now on."""

    def on_report(self, name: str, figures: Figures) -> None:
        """Receive a report of the node of this full name."""

    def on_mark(self, mount: str, mark: Mark) -> None:
        """Receive a mark on the topic `event` of a mount."""


class NodeReports:
    """The last report of each of `nodes` in `namespace`; times (s) on the steady clock."""

    def __init__(self, nodes: tuple[GraphNode, ...], namespace: str):
        self.observer = GraphObserver()
        self._nodes = nodes
        self._names = {name_in(namespace.strip('/'), node.full_name): node.full_name for node in nodes}
        self._figures: dict[str, dict[str, str]] = {}
        self._reported: dict[str, float] = {}
        self._checked = float('inf')
        self._activated: dict[str, tuple[int, float]] = {}  # time on the system clock (ns), and on the steady

    def take(self, message: DiagnosticArray) -> None:
        """Take a message of `/diagnostics`, which all mounts of the car share."""
        now, stamp = time.monotonic(), message.header.stamp
        for report in verdicts_in(message):
            if report.node not in self._names:
                continue
            name = self._names[report.node]
            figures = {**report.figures, 'level': str(report.level), 'sentence': report.sentence}
            since, at = self._activated.get(name, (0, 0.0))
            if stamp.sec * 1_000_000_000 + stamp.nanosec >= since:
                self._activated.pop(name, None)  # the system clock may step back, and all stamps with it
            elif now < at + _LATEST_ARRIVAL:
                figures['state'] = 'active'  # the report was sent before the activation
            self._reported[name], self._figures[name] = now, figures
            self.observer.on_report(name, figures)

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return the last report of a node: its figures, `level` and `sentence`; empty if there is none."""
        return self._figures.get(node.full_name, {})

    def note_active(self, node: GraphNode) -> None:
        """Note the activation of a node, which the node itself reports up to a second later."""
        self._activated[node.full_name] = time.time_ns(), time.monotonic()
        self._figures.setdefault(node.full_name, {'level': '0', 'sentence': ''})['state'] = 'active'
        self.observer.on_state(node, 'active')

    def forget(self, node: GraphNode) -> None:
        """Forget the report of a node, which is no longer true, and expect none until the next."""
        for known in (self._figures, self._activated, self._reported):
            known.pop(node.full_name, None)

    def pause_silence(self) -> None:
        """Count silence from the next `silent` on."""
        self._reported = dict.fromkeys(self._reported, float('inf'))

    def silent(self) -> list[str]:
        """Return the names of the nodes without a report for `SILENCE_LIMIT`.

        Time in which this is not called does not count: this process may have been stopped itself.
        """
        now = time.monotonic()
        stopped = max(0.0, now - self._checked - _LONGEST_PAUSE)
        self._checked = now
        self._reported = {name: min(last + stopped, now) for name, last in self._reported.items()}
        return [name for name, last in self._reported.items() if now - last > SILENCE_LIMIT]

    def check_fatal(self) -> None:
        """Raise `GraphError` if the report of a node is fatal for the graph."""
        for node in self._nodes:
            figures = self.figures(node)
            if flags_of(figures).fatal:
                raise GraphError(f'{node.full_name}: {figures["sentence"]}{self._unanswered(figures)}')

    def initialisation_request(self) -> str:
        """Return why a node requests a new initialisation, or an empty text."""
        for node in self._nodes:
            if flags_of(self.figures(node)).needs_initialisation:
                return f'{node.full_name}: {self.figures(node)["sentence"]}'
        return ''

    def complaints(self) -> str:
        """Return all warnings and errors as one sentence."""
        found = [
            f'{name}: {figures["sentence"]}'
            for name, figures in self._figures.items()
            if int(figures['level']) >= Level.WARN
        ]
        return '; '.join(found) or 'no node complains'

    def _unanswered(self, figures: Figures) -> str:
        """Return the first node of the chain that has not handled the sample which waits for its answer."""
        waiting = figures.get('waiting_stamp', '')
        for node in self._nodes if waiting.isdigit() else ():
            handled = self.figures(node).get('last_stamp', '')
            if node.is_a(DRIVER, CONTROL) and (not handled.isdigit() or int(handled) < int(waiting)):
                return f'; {node.full_name} does not answer'
        return ''
