"""Activates the nodes of a graph: one, or those of all mounts side by side; some are asked twice."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.client import Client

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import DRIVER, SIM, GraphNode
from mount_bringup.graph.pace import Pace, pace
from mount_bringup.graph.transitions import FRESH_DIAGNOSTICS, TRANSITION_LIMIT
from mount_bringup.graph.verdicts import Verdicts
from mount_models.sampling import SAMPLE_RATE
from mount_ros.messages.verdicts import flags_of

_LATE_PATIENCE = 60.0  # s, chosen: until a machine that is too late for an activation is given up


class Graph(Protocol):
    """What activation asks of a graph."""

    nodes: tuple[GraphNode, ...]
    notes: list[str]
    verdicts: Verdicts

    def figures(self, node: GraphNode) -> dict[str, str]: ...
    def transition(self, node: GraphNode, transition: int) -> None: ...
    def refusal(self, node: GraphNode, label: str) -> GraphError: ...
    def wait_for_service(self, node: GraphNode) -> Client: ...
    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None: ...
    def serve_for(self, duration: float) -> None: ...


class Activation:
    """Takes nodes to their active state."""

    def __init__(self, graph: Graph):
        self._graph = graph
        self._noted: dict[str, tuple[int, int]] = {}  # node -> place in the notes, and how often

    def activate(self, node: GraphNode, say: Callable[[str], None]) -> None:
        """Activate a node; one that refuses is asked as often as the graph declares.

        If the machine was late, the refusal tells nothing of the mount: it is asked again for a minute. Nor
        does it where the driver refuses all setpoints until it is activated anew: that is done first.
        """
        begin, asked = time.monotonic(), 0
        while True:
            before = self._pace(node.mount)
            try:
                self._graph.transition(node, Transition.TRANSITION_ACTIVATE)
                self._graph.verdicts.note_active(node)
                return
            except GraphError as error:
                late = self._was_late(node, before)
                asked += not (late or self._needs_initialisation(node))
                if asked >= node.activations or time.monotonic() - begin > _LATE_PATIENCE:
                    raise
                self._tell_again(node, error, before, say)
                self._renew_driver(node, say)

    def _was_late(self, node: GraphNode, before: Pace) -> bool:
        """Return whether this machine has been too late since `before`, by fresh figures."""
        self._graph.serve_for(FRESH_DIAGNOSTICS)
        return self._pace(node.mount).was_late_since(before)

    def _needs_initialisation(self, node: GraphNode) -> bool:
        """Return whether the driver of this node is off until driver and initialisation begin anew."""
        flags = flags_of(self._graph.figures(self._driver(node.mount)))
        return not node.is_a(DRIVER) and flags.needs_initialisation

    def _renew_driver(self, node: GraphNode, say: Callable[[str], None]) -> None:
        if not self._needs_initialisation(node):
            return
        driver = self._driver(node.mount)
        self._note_again(driver, self._graph.figures(driver).get('sentence', ''))
        say(f'activating {driver.full_name} again')
        self._graph.transition(driver, Transition.TRANSITION_DEACTIVATE)
        self._graph.verdicts.forget(driver)  # what it has told was of the activation before
        self._graph.transition(driver, Transition.TRANSITION_ACTIVATE)
        self._graph.verdicts.note_active(driver)

    def _tell_again(
        self, node: GraphNode, error: GraphError, before: Pace, say: Callable[[str], None]
    ) -> None:
        was_late = self._pace(node.mount).was_late_since(before)
        told = self._graph.figures(self._driver(node.mount))
        rate = float(told.get('sample_rate', SAMPLE_RATE))
        reason = f' (this machine was too late for {rate / 1000.0:g} kHz)' if was_late else ''
        self._note_again(node, f'{error}{reason}')
        say(f'activating {node.full_name} again{reason}')

    def _note_again(self, node: GraphNode, why: str) -> None:
        """Note why a node was activated again: one note for each node, of the last time, with a count."""
        place, count = self._noted.get(node.full_name, (len(self._graph.notes), 0))
        self._noted[node.full_name] = place, count + 1
        times = f', the last of {count + 1} times' if count else ''
        self._graph.notes[place : place + 1] = [f'{why}; it was activated again{times}']

    def activate_all(self, nodes: Sequence[GraphNode], say: Callable[[str], None]) -> None:
        """Activate one node, or those of all mounts at the same time; one that refuses is asked by itself."""
        say(f'activating {", ".join(node.full_name for node in nodes)}')
        for node in nodes:
            self._graph.verdicts.witness.state(node, 'activating')
        if len(nodes) == 1:
            self.activate(nodes[0], say)
            return
        before = {node: self._pace(node.mount) for node in nodes}
        clients = {node: self._graph.wait_for_service(node) for node in nodes}
        request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_ACTIVATE))
        answers = {node: client.call_async(request) for node, client in clients.items()}
        names = ', '.join(node.full_name for node in nodes)

        def all_done() -> bool:
            return all(answer.done() for answer in answers.values())

        self._graph.wait_until(all_done, TRANSITION_LIMIT, f'activate of {names}')
        for node in nodes:
            if answers[node].result().success:
                self._graph.verdicts.note_active(node)
        for node in nodes:
            if not answers[node].result().success:
                error = self._graph.refusal(node, 'activate')
                if not self._was_late(node, before[node]) and node.activations == 1:
                    raise error
                self._tell_again(node, error, before[node], say)
                self._renew_driver(node, say)
                self.activate(node, say)

    def _pace(self, mount: str) -> Pace:
        return pace(self._graph.figures(self._driver(mount)), self._graph.figures(SIM))

    def _driver(self, mount: str) -> GraphNode:
        drivers = (node for node in self._graph.nodes if node.is_a(DRIVER) and node.mount == mount)
        return next(drivers, DRIVER)
