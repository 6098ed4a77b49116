"""What follows the failure of nodes, how often, and its steps; only in real time."""

import time
from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from mount_bringup.graph.graph import ANSWER_LIMIT, CONFIGURE, Graph
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, SIM, Figures, GraphError, GraphNode
from mount_bringup.graph.processes import NodeProcess
from mount_models.sampling import sample_time_ns
from mount_recorder.folders import next_recording
from mount_ros.messages.verdicts import flags_of

_WINDOW = 60.0  # s, chosen: within which the failures of a node are counted


class RecoveryAction(Enum):
    """How a graph comes back to work after a failure, in words; those that include others first."""

    END = 'the graph ends'
    INITIALISE = 'the mount is initialised anew'
    DAMP_ON = 'it is started again and activated with the table that holds'
    RECORD_ANEW = 'it is started again with a new recording'
    STAND_BY = 'it is started again and left inactive, for its result still holds'


ACTIONS: dict[str, RecoveryAction] = {
    RECORDER.name: RecoveryAction.RECORD_ANEW,
    # Nothing of the last initialisation is known to hold of electronics to which no driver was connected.
    DRIVER.name: RecoveryAction.INITIALISE,
    # Gaps and table stand as long as the electronics do; a ramp would only take the damping away.
    INIT.name: RecoveryAction.STAND_BY,
    CONTROL.name: RecoveryAction.DAMP_ON,
    # The electronics themselves: there is nothing left to drive.
    SIM.name: RecoveryAction.END,
}
"""The action after the failure of each node."""


class NodesFailedError(GraphError):
    """Nodes ended or hang, or none where the electronics lost their initialisation; the text is why."""

    def __init__(self, nodes: Collection[GraphNode], reason: str):
        super().__init__(reason)
        self.nodes = nodes


@dataclass(frozen=True)
class Restart:
    """A recovery: when the failure was seen (ns, system clock), why, and how long it took (s)."""

    time: int
    nodes: tuple[GraphNode, ...]
    reason: str
    action: RecoveryAction
    took: float

    @property
    def sentence(self) -> str:
        """The failure, the action and its duration, for people."""
        return f'{self.reason}; {self.action.value}: back after {self.took:.1f} s'


def recovery_action(nodes: Collection[GraphNode], *, table_holds: bool) -> RecoveryAction:
    """Return the action after the failure of nodes, of the electronics where there are none.

    A control without a valid table would only be refused, and electronics that were reset have forgotten all.
    """
    actions = {ACTIONS[node.name] for node in nodes} or {RecoveryAction.INITIALISE}
    if RecoveryAction.DAMP_ON in actions and (RecoveryAction.STAND_BY in actions or not table_holds):
        actions.add(RecoveryAction.INITIALISE)
    return next(action for action in RecoveryAction if action in actions)


def table_holds(driver: Figures, init: Figures) -> bool:
    """Return whether the table of `mount_init` is of the measurements that come now, by the figures of both.

    It is where the driver has taken samples without a break since before the table was made. A driver that
    was activated since, or saw the electronics pause or restart, cannot say so.
    """
    try:
        whole = int(driver['restarts']) == 0 == int(driver['gaps'])
        period = sample_time_ns(float(driver['sample_rate']))
        measured = (int(driver['samples']) + int(driver['lost'])) * period
        since = int(driver['last_stamp']) - int(init['last_stamp'])
    except (KeyError, ValueError):
        return False
    both_active = driver.get('state') == init.get('state') == 'active'
    return both_active and whole and measured > since and not flags_of(driver).needs_initialisation


class Recovery:
    """Recovers from failures and keeps each as a `Restart`.

    More failures of a node within a minute than `restart_limit` of the settings end the graph; 0: the first.
    """

    def __init__(self, graph: Graph, processes: Sequence[NodeProcess]):
        self.restarts: list[Restart] = []
        self.report: Callable[[str], None] = lambda sentence: None
        """Takes the sentence about each failure at once."""
        self._graph, self._processes = graph, processes
        self._times: dict[str, list[float]] = defaultdict(list)  # of the failures of a node, s, steady clock
        self._celsius: dict[str, float] = {}  # driver -> coil temperature of its last report

    def recover(self, failure: NodesFailedError) -> None:
        """Return when the graph works again; raise `GraphError` where it is given up."""
        begin, at, figures = time.monotonic(), time.time_ns(), self._graph.figures
        active = {node for node in self._graph.nodes if figures(node).get('state') == 'active'}
        nodes: dict[GraphNode, None] = {}
        reasons: list[str] = []
        while True:
            self._count(failure)
            nodes |= dict.fromkeys(failure.nodes)
            reasons.append(str(failure))
            self.report(f'{failure}; {self._action(nodes).value}')
            try:
                action = self._bring_back(nodes, active)
                break
            except NodesFailedError as another:
                failure = another
        took = time.monotonic() - begin
        self.restarts.append(Restart(at, tuple(nodes), '; then '.join(reasons), action, took))

    def initialise_again(self) -> str:
        """Return the gaps of a new initialisation: 0 A, a ramp, a table, and an activation of the control.

        Where it raises `GraphError` control is not active.
        """
        graph, nodes = self._graph, self._chain(())
        for node in reversed(nodes):  # control first: damping off, 0 A
            graph.deactivate(node)
        graph.wait_for_matches()
        for node in nodes:
            graph.activate([node])
        inits = [node for node in nodes if node.is_a(INIT)]
        return '; '.join(f'{node.full_name}: {graph.fresh_figures(node)["sentence"]}' for node in inits)

    def _count(self, failure: NodesFailedError) -> None:
        """Count a failure; raise `GraphError` where it ends the graph."""
        limit = self._graph.settings.restart_limit
        if limit == 0:
            raise failure
        if any(ACTIONS[node.name] is RecoveryAction.END for node in failure.nodes):
            raise GraphError(f'{failure}; without it there is no coil to drive: the graph ends')
        now = time.monotonic()
        for name in [node.full_name for node in failure.nodes] or ['electronics']:
            times = self._times[name]
            times[:] = [at for at in times if now - at <= _WINDOW] + [now]
            if len(times) > limit:
                raise GraphError(
                    f'{failure}; {name} was lost {len(times)} times within {_WINDOW:g} s '
                    f'(limit {limit}), so the graph is given up at 0 A: read the logs for the cause'
                )

    def _bring_back(self, failed: Collection[GraphNode], active: set[GraphNode]) -> RecoveryAction:
        graph, action, chain = self._graph, self._action(failed), self._chain(failed)
        wanted = {node for node in failed if not node.is_a(INIT)} & active
        for node in failed:
            figures = graph.figures(node)
            if flags_of(figures).coil_model_known:
                self._celsius[node.full_name] = float(figures['coil_model_celsius'])
            graph.forget(node)
        for process in self._processes:  # first: each wait for the others would find them failed once more
            if {*process.nodes} & {*failed}:
                process.start_again()
        if action is RecoveryAction.INITIALISE:
            wanted |= {node for node in chain if node in active or not node.is_a(CONTROL)}
            for node in reversed(chain):
                if node not in failed:
                    graph.deactivate(node)
        for node in graph.nodes:
            if node in failed:
                self._wait_for_start(node)
                self._prepare(node, action)
                graph.transition([node], CONFIGURE)
        graph.wait_for_matches()
        if action is RecoveryAction.DAMP_ON:
            for node in chain:
                if node.is_a(DRIVER):
                    graph.fresh_figures(node)
            if self._action(failed) is not action:  # a later break is seen by the control itself
                return self._bring_back(failed, active)
        for node in graph.nodes:
            if node in wanted:
                graph.activate([node])
        return action

    def _action(self, failed: Collection[GraphNode]) -> RecoveryAction:
        chain, figures = self._chain(failed), self._graph.figures
        drivers, inits = ([figures(node) for node in chain if node.is_a(kind)] for kind in (DRIVER, INIT))
        return recovery_action(failed, table_holds=all(map(table_holds, drivers, inits)))

    def _chain(self, failed: Collection[GraphNode]) -> list[GraphNode]:
        """Return driver, initialisation and control of the mounts of a failure; without a node of all."""
        chain = [node for node in self._graph.nodes if node.is_a(DRIVER, INIT, CONTROL)]
        mounts = {node.mount for node in chain if node in failed or not failed}
        return [node for node in chain if node.mount in mounts]

    def _wait_for_start(self, node: GraphNode) -> None:
        """Wait until the new node answers: not yet configured."""
        client = self._graph.client(GetState, f'{node.full_name}/get_state')
        answers: list[Any] = []

        def started() -> bool:
            # Again and again: the middleware may still know the dead predecessor, and ask that one.
            if client.service_is_ready():
                answers.append(client.call_async(GetState.Request()))
            states = [answer.result().current_state.id for answer in answers if answer.done()]
            return State.PRIMARY_STATE_UNCONFIGURED in states

        self._graph.wait_until(started, ANSWER_LIMIT, f'start of {node.full_name} again')

    def _prepare(self, node: GraphNode, action: RecoveryAction) -> None:
        """Set what a node that is started again needs besides the parameters of its start."""
        values: dict[str, object] = {}
        if node.is_a(RECORDER):
            uri = self._graph.settings.parameters[node.full_name]['uri']
            values['uri'] = str(next_recording(Path(str(uri))))
        elif node.full_name in self._celsius:
            values['coil_celsius_before'] = self._celsius[node.full_name]
        elif node.is_a(CONTROL):
            values['measured_before'] = action is RecoveryAction.DAMP_ON
        for name, value in values.items():
            parameters = [Parameter(name, value=value).to_parameter_msg()]
            service = f'{node.full_name}/set_parameters'
            [result] = self._graph.call(SetParameters, service, parameters=parameters).results
            if not result.successful:
                raise GraphError(f'{node.full_name} refused {name}: {result.reason}')
