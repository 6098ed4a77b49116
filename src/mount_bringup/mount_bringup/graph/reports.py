"""The reports of the nodes on `/diagnostics`: what they say, and since when a node is silent."""

import time
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray

from mount_bringup.graph.nodes import CONTROL, DRIVER, Figures, GraphError, GraphNode
from mount_ros.messages.event import Mark
from mount_ros.messages.verdicts import flags_of, verdicts_in
from mount_ros.nodes.diagnostics import Level

SILENCE_LIMIT = 4.0
"""Seconds (chosen) without diagnostics, which come once a second, until a node is treated as failed."""
_LONGEST_PAUSE = 0.5  # s, chosen: ten times the period in which the supervisor checks
_NANOSECONDS = 1_000_000_000
_LATEST_ARRIVAL = 2.0  # s, chosen: until then a report that was sent before an activation has arrived


class GraphObserver:
    """Receives events of the graph; this one ignores them."""

    def on_state(self, node: GraphNode, state: str) -> None:
        """Receive that a node is `configured`, `activating` or `active` from now on."""

    def on_report(self, name: str, figures: Figures) -> None:
        """Receive a report of the node of this full name."""

    def on_mark(self, mount: str, mark: Mark) -> None:
        """Receive a mark on the topic `event` of a mount."""


class Silence:
    """Detects nodes without a report for `SILENCE_LIMIT`; times (s) on the steady clock.

    Time in which `silent` is not called does not count: this process may have been stopped itself.
    """

    def __init__(self) -> None:
        self._reported: dict[str, float] = {}
        self._checked: float | None = None

    def note(self, name: str, now: float) -> None:
        """Note a report of a node: it is expected to go on."""
        self._reported[name] = now

    def forget(self, name: str) -> None:
        """Expect nothing of a node until its next report."""
        self._reported.pop(name, None)

    def pause(self) -> None:
        """Count from the next check on."""
        self._reported = dict.fromkeys(self._reported, float('inf'))

    def silent(self, now: float) -> list[str]:
        """Return the names of the silent nodes."""
        checked, self._checked = self._checked, now
        stopped = max(0.0, now - checked - _LONGEST_PAUSE) if checked is not None else 0.0
        self._reported = {name: min(last + stopped, now) for name, last in self._reported.items()}
        return [name for name, last in self._reported.items() if now - last > SILENCE_LIMIT]


def silence_sentence(names: Sequence[str]) -> str:
    """Return the sentence about silent nodes: value, limit and remedy."""
    return (
        f'{", ".join(names)}: no diagnostics for {SILENCE_LIMIT:g} s (limit {SILENCE_LIMIT:g} s): treated as '
        'failed; check its log and the CPU load'
    )


class NodeReports:
    """The last report of each node in `namespace`."""

    def __init__(self, nodes: Sequence[GraphNode], namespace: str):
        self.silence = Silence()
        self.observer = GraphObserver()
        self._nodes = {node.full_name: node for node in nodes}
        self._space = f'{namespace.strip("/")}/'.lstrip('/')
        self._figures: dict[str, dict[str, str]] = {}
        self._activated: dict[str, tuple[int, float]] = {}  # time on the system clock (ns), steady clock (s)

    def take(self, message: DiagnosticArray) -> None:
        """Take a message of `/diagnostics`, which all mounts of the car share."""
        sent = message.header.stamp.sec * _NANOSECONDS + message.header.stamp.nanosec
        for report in verdicts_in(message):
            name = report.node.removeprefix(self._space)
            if name not in self._nodes or not report.node.startswith(self._space):
                continue
            self.silence.note(name, time.monotonic())
            figures = {**report.figures, 'level': str(report.level), 'sentence': report.sentence}
            stamp, begin = self._activated.get(name, (0, 0.0))
            if sent < stamp and time.monotonic() < begin + _LATEST_ARRIVAL:
                figures['state'] = 'active'  # the report was sent before the activation
            else:
                self._activated.pop(name, None)  # the system clock may step back, and all stamps with it
            self._figures[name] = figures
            self.observer.on_report(name, figures)

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return the last report of a node; empty if there is none."""
        return self._figures.get(node.full_name, {})

    def note_active(self, node: GraphNode) -> None:
        """Note the activation of a node, which the node itself reports up to a second later."""
        self._activated[node.full_name] = time.time_ns(), time.monotonic()
        self._figures.setdefault(node.full_name, {'level': '0', 'sentence': ''})['state'] = 'active'
        self.observer.on_state(node, 'active')

    def forget(self, node: GraphNode) -> None:
        """Forget the report of a node: it is no longer true."""
        self._figures.pop(node.full_name, None)
        self._activated.pop(node.full_name, None)
        self.silence.forget(node.full_name)

    def check_fatal(self) -> None:
        """Raise `GraphError` if the report of a node is fatal for the graph."""
        for name, node in self._nodes.items():
            figures = self.figures(node)
            if flags_of(figures).fatal:
                raise GraphError(f'{name}: {figures["sentence"]}{self._unanswered(figures)}')

    def initialisation_request(self) -> str:
        """Return why a node requests a new initialisation, or an empty text."""
        for name, node in self._nodes.items():
            figures = self.figures(node)
            if flags_of(figures).needs_initialisation:
                return f'{name}: {figures["sentence"]}'
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
        for name, node in self._nodes.items() if waiting.isdigit() else ():
            handled = self.figures(node).get('last_stamp', '')
            if node.is_a(DRIVER, CONTROL) and (not handled.isdigit() or int(handled) < int(waiting)):
                return f'; {name} does not answer'
        return ''
