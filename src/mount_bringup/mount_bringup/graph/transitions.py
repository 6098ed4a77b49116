"""Takes nodes through transitions of their lifecycle, and tells in their own words why one was refused."""

import time
from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import NamedTuple, Protocol

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.client import Client
from rclpy.task import Future

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import GraphNode
from mount_bringup.graph.verdicts import Verdicts
from mount_ros.nodes.diagnostics import Level

FRESH_DIAGNOSTICS = 1.5
"""Seconds (chosen): every node tells its figures once a second."""
TRANSITION_LIMIT = 60.0
"""Seconds (chosen): activation of mount_init includes its current ramp."""
_CONFIGURE = Transition.TRANSITION_CONFIGURE
_LABELS = {1: 'configure', 3: 'activate', 4: 'deactivate'}


class Graph(Protocol):
    """What a transition asks of a graph."""

    verdicts: Verdicts

    def figures(self, node: GraphNode) -> dict[str, str]: ...
    def wait_for_service(self, node: GraphNode) -> Client: ...
    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None: ...
    def serve_once(self) -> None: ...


class Transitions:
    """Asks nodes for transitions and takes their answers."""

    def __init__(self, graph: Graph):
        self._graph = graph

    def configure(self, processes: Sequence[Sequence[GraphNode]]) -> None:
        """Configure the nodes of all processes side by side, those of one process in their order.

        It counts there: the data thread serves those first that came last.
        """
        for side_by_side in zip_longest(*processes):
            for asked in [self._ask(node, _CONFIGURE) for node in side_by_side if node is not None]:
                self._take_answer(asked)

    def make(self, node: GraphNode, transition: int) -> None:
        """Take a node through a transition, or raise `GraphError` with the node's own reason."""
        self._take_answer(self._ask(node, transition))

    def refusal(self, node: GraphNode, label: str) -> GraphError:
        """Return the error of a refused transition with the node's own reason."""
        return GraphError(f'{node.full_name} refused to {label}: {self._reason(node)}')

    def _ask(self, node: GraphNode, transition: int) -> '_Asked':
        client = self._graph.wait_for_service(node)
        request = ChangeState.Request(transition=Transition(id=transition))
        return _Asked(node, transition, client.call_async(request))

    def _take_answer(self, asked: '_Asked') -> None:
        label = _LABELS.get(asked.transition, str(asked.transition))
        self._graph.wait_until(asked.answer.done, TRANSITION_LIMIT, f'{label} of {asked.node.full_name}')
        if not asked.answer.result().success:
            raise self.refusal(asked.node, label)
        if asked.transition == _CONFIGURE:
            self._graph.verdicts.witness.state(asked.node, 'configured')

    def _reason(self, node: GraphNode) -> str:
        """Return what the node says of its refusal; it may come after the answer."""
        end = time.monotonic() + FRESH_DIAGNOSTICS
        while int(self._graph.figures(node).get('level', Level.OK)) < Level.ERROR and time.monotonic() < end:
            self._graph.serve_once()
        return self._graph.figures(node).get('sentence', '(it said nothing)')


class _Asked(NamedTuple):
    node: GraphNode
    transition: int
    answer: Future
