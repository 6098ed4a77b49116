"""Brings a running graph back to work after a failure of nodes, or initialises its mounts again on request.

Only in real time: in lock-step a failed node ends the run.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from mount_bringup.graph.activation import Activation
from mount_bringup.graph.failures import (
    FailureCount,
    NodeFailure,
    NodesFailedError,
    RecoveryAction,
    Restart,
    recovery_action,
    table_holds,
)
from mount_bringup.graph.graph import CONFIGURE, DEACTIVATE, Graph
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, GraphError, GraphNode
from mount_bringup.graph.processes import NodeProcesses
from mount_recorder.folders import next_recording
from mount_ros.messages.verdicts import flags_of

_START_LIMIT = 60.0  # s, chosen
_REQUEST_PERIOD = 0.5  # s, chosen: the middleware may still know the dead predecessor, and ask that one


class Recovery:
    """Recovers from failures and keeps each one as a `Restart`; `limit` as in `FailureCount`."""

    def __init__(self, graph: Graph, processes: NodeProcesses, activation: Activation, limit: int):
        self.restarts: list[Restart] = []
        self.report: Callable[[str], None] = lambda sentence: None
        """Takes the sentence about each failure at once."""
        self._graph, self._processes, self._activation = graph, processes, activation
        self._count = FailureCount(limit)
        self._celsius: dict[str, float] = {}  # driver -> coil temperature of its last report

    def recover(self, failure: NodeFailure) -> None:
        """Return when the graph works again; raise `GraphError` where it is given up."""
        begin, at = time.monotonic(), time.time_ns()
        self._note(failure, failure)
        active = {node for node in self._graph.nodes if self._graph.figures(node).get('state') == 'active'}
        while True:
            try:
                action = self._bring_back(failure, active)
                break
            except NodesFailedError as more:
                failure = failure.with_more(more.failure)
                self._note(more.failure, failure)
        self.restarts.append(Restart(at, failure, action, time.monotonic() - begin))

    def _note(self, failure: NodeFailure, whole: NodeFailure) -> None:
        """Count and report a failure, the last part of a `whole`; one that ends the graph is in the error."""
        self._count.note(failure, time.monotonic())
        for node in failure.nodes:
            figures = self._graph.figures(node)
            if node.is_a(DRIVER) and flags_of(figures).coil_model_known:
                self._celsius[node.full_name] = float(figures['coil_model_celsius'])
        self.report(f'{failure.reason}; {self._action(whole).value}')

    def _bring_back(self, failure: NodeFailure, active: set[GraphNode]) -> RecoveryAction:
        graph, action = self._graph, self._action(failure)
        for node in failure.nodes:
            graph.reports.forget(node)
        # First: each wait for the others would find them failed once more.
        self._processes.start_again(failure.nodes)
        if action is RecoveryAction.INITIALISE:
            for node in self._of_mounts(failure, CONTROL, INIT, DRIVER):
                if node not in failure.nodes:
                    deactivate(graph, node)
        for node in (node for node in graph.nodes if node in failure.nodes):
            self._wait_for_start(node)
            self._prepare(node, action)
            graph.transition([node], CONFIGURE)
        graph.wait_for_matches()
        if action is RecoveryAction.DAMP_ON:
            for driver in self._of_mounts(failure, DRIVER):
                graph.fresh_figures(driver)
            if self._action(failure) is not action:  # a later break is seen by the control itself
                return self._bring_back(failure, active)
        wanted = {node for node in failure.nodes if not node.is_a(INIT)} & active
        if action is RecoveryAction.INITIALISE:
            wanted |= {*self._of_mounts(failure, DRIVER, INIT)}
            wanted |= {*self._of_mounts(failure, CONTROL)} & active
        for node in graph.nodes:
            if node in wanted:
                self._activation.activate([node])
        return action

    def _action(self, failure: NodeFailure) -> RecoveryAction:
        figures = self._graph.figures
        pairs = zip(self._of_mounts(failure, DRIVER), self._of_mounts(failure, INIT), strict=True)
        holds = all(table_holds(figures(driver), figures(init)) for driver, init in pairs)
        return recovery_action(failure, table_holds=holds)

    def _of_mounts(self, failure: NodeFailure, *kinds: GraphNode) -> list[GraphNode]:
        """Return the nodes of these kinds in the mounts of a failure; one of the electronics is of all."""
        mounts = {node.mount for node in failure.nodes if node.is_a(DRIVER, INIT, CONTROL)}
        return [
            node
            for kind in kinds
            for node in self._graph.nodes
            if node.is_a(kind) and (node.mount in mounts or not failure.nodes)
        ]

    def _wait_for_start(self, node: GraphNode) -> None:
        """Wait until the new node answers: not yet configured."""
        client = self._graph.client(GetState, f'{node.full_name}/get_state')
        answers: list[Any] = []
        requested = 0.0

        def started() -> bool:
            nonlocal requested
            if time.monotonic() - requested > _REQUEST_PERIOD and client.service_is_ready():
                requested = time.monotonic()
                answers.append(client.call_async(GetState.Request()))
            return any(
                answer.done() and answer.result().current_state.id == State.PRIMARY_STATE_UNCONFIGURED
                for answer in answers
            )

        self._graph.wait_until(started, _START_LIMIT, f'start of {node.full_name} again')

    def _prepare(self, node: GraphNode, action: RecoveryAction) -> None:
        if node.is_a(RECORDER):
            first = Path(str(self._graph.parameters[node.full_name]['uri']))
            self._set(node, 'uri', str(next_recording(first)))
        elif node.full_name in self._celsius:
            self._set(node, 'coil_celsius_before', self._celsius[node.full_name])
        elif node.is_a(CONTROL):
            self._set(node, 'measured_before', action is RecoveryAction.DAMP_ON)

    def _set(self, node: GraphNode, name: str, value: object) -> None:
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        result = self._graph.call(SetParameters, f'{node.full_name}/set_parameters', request).results[0]
        if not result.successful:
            raise GraphError(f'{node.full_name} refused {name}: {result.reason}')


def deactivate(graph: Graph, node: GraphNode) -> None:
    """Deactivate a node if it is active."""
    state = graph.call(GetState, f'{node.full_name}/get_state', GetState.Request()).current_state
    if state.id == State.PRIMARY_STATE_ACTIVE:
        graph.transition([node], DEACTIVATE)


def initialise_again(graph: Graph, activation: Activation, mount: str) -> str:
    """Return the gaps of a new initialisation: 0 A, a ramp, a table, and an activation of the control.

    Of the mount of this name, of all if it is empty. Where it raises `GraphError` control is not active.
    """
    nodes = [node for node in graph.nodes if node.is_a(DRIVER, INIT, CONTROL)]
    nodes = [node for node in nodes if not mount or node.mount == mount]
    for node in reversed(nodes):  # control first: damping off, 0 A
        deactivate(graph, node)
    graph.wait_for_matches()
    for node in nodes:
        activation.activate([node])
    inits = [node for node in nodes if node.is_a(INIT)]
    return '; '.join(f'{node.full_name}: {graph.fresh_figures(node)["sentence"]}' for node in inits)
