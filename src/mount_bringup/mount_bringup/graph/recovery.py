"""Brings a running graph back to work after the loss of a node, by the policy of `restarts.py`."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.parameter import Parameter

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, GraphNode
from mount_bringup.graph.reinitialisation import deactivate
from mount_bringup.graph.restarts import (
    Loss,
    NodesLostError,
    Remedy,
    Restart,
    RestartCount,
    remedy,
    table_holds,
)
from mount_bringup.graph.verdicts import Verdicts
from mount_recorder.folders import next_recording

_BIRTH_LIMIT = 60.0  # s, chosen
_ASK_PERIOD = 0.5  # s, chosen: the middleware may still believe in the dead predecessor, and ask that one
_FRESH_LIMIT = 5.0  # s, chosen: for the driver's next diagnostics, which come once a second


class Graph(Protocol):
    """What recovery asks of a running graph; each wait raises `NodesLostError` where another node is lost."""

    nodes: tuple[GraphNode, ...]
    parameters: dict[str, dict[str, object]]
    verdicts: Verdicts
    tell_loss: Callable[[str], None]

    def figures(self, node: GraphNode) -> dict[str, str]: ...
    def start_again(self, nodes: Sequence[GraphNode]) -> None: ...
    def transition(self, node: GraphNode, transition: int) -> None: ...
    def activate(self, node: GraphNode, say: Callable[[str], None]) -> None: ...
    def wait_for_matches(self) -> None: ...
    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None: ...
    def client(self, kind: Any, service: str) -> Client: ...
    def call(self, kind: Any, service: str, request: Any) -> Any: ...


class Recovery:
    """Makes losses good, and notes each one as a `Restart`; `limit` as in `RestartCount`."""

    def __init__(self, graph: Graph, limit: int):
        self.restarts: list[Restart] = []
        self._graph = graph
        self._count = RestartCount(limit)
        self._celsius: dict[str, float] = {}  # driver -> how hot its coil was when it told so last

    def make_good(self, loss: Loss) -> None:
        """Return when the graph works again; raise `GraphError` where it is given up."""
        begin, at = time.monotonic(), time.time_ns()
        self._take(loss, loss)
        active = [node for node in self._graph.nodes if self._graph.figures(node).get('state') == 'active']
        while True:
            try:
                chosen = self._bring_back(loss, active)
                break
            except NodesLostError as more:
                loss = loss.with_more(more.loss)
                self._take(more.loss, loss)
        self.restarts.append(Restart(at, loss, chosen, time.monotonic() - begin))

    def _take(self, loss: Loss, whole: Loss) -> None:
        """Count a loss and tell it at once, with what follows from the `whole` of which it is the last part.

        One for which the graph is given up stands in the error alone.
        """
        self._count.note(loss, time.monotonic())
        for node in loss.nodes:
            figures = self._graph.figures(node)
            if node.is_a(DRIVER) and figures.get('coil_model_known') == 'True':
                self._celsius[node.full_name] = float(figures['coil_model_celsius'])
        self._graph.tell_loss(f'{loss.reason}; {remedy(whole, self._table_holds(whole)).value}')

    def _bring_back(self, loss: Loss, active: Sequence[GraphNode]) -> Remedy:
        graph = self._graph
        chosen = remedy(loss, table_holds=self._table_holds(loss))
        graph.start_again(loss.nodes)  # first: each wait for the others would find them lost once more
        if chosen is Remedy.INITIALISE:
            for node in self._of_mounts(loss, CONTROL, INIT, DRIVER):
                if node not in loss.nodes:
                    deactivate(graph, node)
        for node in (node for node in graph.nodes if node in loss.nodes):
            self._await_birth(node)
            self._prepare(node, chosen)
            graph.transition(node, Transition.TRANSITION_CONFIGURE)
        graph.wait_for_matches()
        if chosen is Remedy.DAMP_ON and not self._table_holds_still(loss):
            return self._bring_back(loss, active)
        wanted = {node for node in loss.nodes if not node.is_a(INIT)} & {*active}
        if chosen is Remedy.INITIALISE:
            wanted |= {*self._of_mounts(loss, DRIVER, INIT)} | ({*self._of_mounts(loss, CONTROL)} & {*active})
        for node in graph.nodes:
            if node in wanted:
                graph.activate(node, lambda _: None)
        return chosen

    def _of_mounts(self, loss: Loss, *kinds: GraphNode) -> list[GraphNode]:
        """Return the nodes of these kinds in the mounts that a loss concerns; one of the electronics all."""
        concerned = {node.mount for node in loss.nodes if node.is_a(DRIVER, INIT, CONTROL)}
        return [
            node
            for kind in kinds
            for node in self._graph.nodes
            if node.is_a(kind) and (node.mount in concerned or not loss.nodes)
        ]

    def _table_holds(self, loss: Loss) -> bool:
        figures = self._graph.figures
        pairs = zip(self._of_mounts(loss, DRIVER), self._of_mounts(loss, INIT), strict=True)
        return all(table_holds(figures(driver), figures(init)) for driver, init in pairs)

    def _table_holds_still(self, loss: Loss) -> bool:
        """Return the same by what the driver tells now; a later break is seen by the control itself."""
        graph = self._graph
        for driver in self._of_mounts(loss, DRIVER):
            graph.verdicts.forget(driver)
            heard = partial(lambda driver: bool(graph.figures(driver)), driver)
            graph.wait_until(heard, _FRESH_LIMIT, f'a word of {driver.full_name}')
        return self._table_holds(loss)

    def _await_birth(self, node: GraphNode) -> None:
        """Return when the new node answers: not yet configured."""
        client = self._graph.client(GetState, f'{node.full_name}/get_state')
        answers: list[Any] = []
        asked = 0.0

        def born() -> bool:
            nonlocal asked
            if time.monotonic() - asked > _ASK_PERIOD and client.service_is_ready():
                asked = time.monotonic()
                answers.append(client.call_async(GetState.Request()))
            return any(
                answer.done() and answer.result().current_state.id == State.PRIMARY_STATE_UNCONFIGURED
                for answer in answers
            )

        self._graph.wait_until(born, _BIRTH_LIMIT, f'start of {node.full_name} again')

    def _prepare(self, node: GraphNode, chosen: Remedy) -> None:
        if node.is_a(RECORDER):
            first = Path(str(self._graph.parameters[RECORDER.name]['uri']))
            self._set(node, 'uri', str(next_recording(first)))
        elif node.is_a(DRIVER) and node.full_name in self._celsius:
            self._set(node, 'coil_celsius_before', self._celsius[node.full_name])
        elif node.is_a(CONTROL):
            self._set(node, 'measured_before', chosen is Remedy.DAMP_ON)

    def _set(self, node: GraphNode, name: str, value: object) -> None:
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        result = self._graph.call(SetParameters, f'{node.full_name}/set_parameters', request).results[0]
        if not result.successful:
            raise GraphError(f'{node.full_name} refused {name}: {result.reason}')
