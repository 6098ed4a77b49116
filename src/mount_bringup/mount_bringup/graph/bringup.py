"""Brings the nodes of a graph to life and watches them, whoever has started their processes."""

import time
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.client import Client

from mount_bringup.graph.activation import Activation
from mount_bringup.graph.errors import GraphError, Interrupted
from mount_bringup.graph.liveliness import silence_sentence
from mount_bringup.graph.matches import crowded, waiting
from mount_bringup.graph.nodes import (
    DRIVER,
    SIM,
    GraphNode,
    GraphSettings,
    ending_order,
    groups,
)
from mount_bringup.graph.own_node import OwnNode
from mount_bringup.graph.parameters import parameters_of
from mount_bringup.graph.recovery import Recovery
from mount_bringup.graph.reinitialisation import initialise_anew, offer
from mount_bringup.graph.restarts import Loss, NodesLostError, Restart
from mount_bringup.graph.transitions import TRANSITION_LIMIT, Transitions
from mount_bringup.graph.verdicts import Verdicts
from mount_bringup.mounts import settings_of_mount
from mount_ros.environment import loopback_refusal
from mount_ros.nodes.shutdown import Deadline, remove_abandoned
from mount_sim.diagnosis import FINISHED

_START_LIMIT = 60.0  # s, chosen: a first start may compile the laws
_MATCH_LIMIT = 20.0  # s, chosen
_LONGEST_HANG = 30.0  # s, chosen: then the supervisor ends, and its nodes go to 0 A by themselves


class Bringup:
    """The nodes of a graph as one thing: `start`, `wait_until`, and `stop`.

    Once started, in real time, it makes good the loss of a node as `restarts.py` says. Who has the processes
    of the nodes overrides `start_nodes`, `check_processes` and `start_again`.
    """

    def __init__(self, nodes: tuple[GraphNode, ...], settings: GraphSettings):
        self.nodes = nodes
        self.parameters: dict[str, dict[str, object]] = {}
        """All parameters of all nodes, as they were at the start."""
        self.notes: list[str] = []
        self.at_rest = False
        """Whether `stop` has deactivated all nodes: then nothing depends on the order of their ends."""
        self.verdicts = Verdicts(nodes, settings.namespace)
        self.tell_loss: Callable[[str], None] = lambda text: None
        """Takes the reason of each loss that is made good."""
        self._settings = settings
        self._groups = groups(nodes, settings.grouping)
        self._mounts = list(dict.fromkeys(node.mount for node in nodes if node.is_a(DRIVER))) or ['']
        self._interrupted = False  # no lock: a second signal may come amid the first
        self._own = OwnNode(settings, self._mounts, self.verdicts)
        self._deadline = Deadline(code=1)
        self._transitions = Transitions(self)
        self._activation = Activation(self)
        self._recovery = Recovery(self, settings.restart_limit)
        self._makes_good = False

    def interrupt(self) -> None:
        """Make every wait of the supervisor end with `Interrupted`; safe from a signal handler."""
        self._interrupted = True

    def start(
        self, session: Callable[[dict[str, dict[str, object]]], str], say: Callable[[str], None]
    ) -> None:
        """Bring all nodes to life; `session` makes the session text of a mount from its nodes' parameters."""
        if refusal := loopback_refusal():
            raise GraphError(refusal)
        remove_abandoned()
        self._own.open()
        offer(self._own.node, self._mounts, self._begin_anew)
        say('starting the nodes')
        self.start_nodes()
        self._transitions.configure(self._groups)
        self.parameters = {node.full_name: parameters_of(node.full_name, self.call) for node in self.nodes}
        for mount in self._mounts:
            self._own.tell_session(mount, session(settings_of_mount(self.parameters, mount)))
        self.wait_for_matches()
        for _, side_by_side in groupby(self.nodes, lambda node: node.name):
            nodes = list(side_by_side)
            self.await_inputs(nodes, say)
            self._activation.activate_all(nodes, say)
        self._makes_good = not any(values.get('lockstep') for values in self.parameters.values())
        self.verdicts.liveliness.pause()

    def start_nodes(self) -> None:
        """See to it that the nodes of this graph, and no others of their names, are there."""
        for node in self.nodes:
            self.wait_for_service(node)
        self.refuse_others(own=1)

    def check_processes(self) -> None:
        """Raise `NodesLostError` if a process is no more what it was."""

    def await_inputs(self, nodes: Sequence[GraphNode], say: Callable[[str], None]) -> None:
        """Return when what `nodes` need to be activated is there; in a graph it is."""

    @property
    def finished(self) -> bool:
        """Whether the drive is over; the simulator tells it."""
        return self.figures(SIM).get('sentence') == FINISHED

    def start_again(self, nodes: Sequence[GraphNode]) -> None:
        """End what is left of the processes of `nodes`, and start them again."""
        raise GraphError(f'{" + ".join(node.name for node in nodes)} cannot be started again from here')

    @property
    def restarts(self) -> list[Restart]:
        """The losses that were made good, in order."""
        return self._recovery.restarts

    def activate(self, node: GraphNode, say: Callable[[str], None]) -> None:
        """Activate a node; one that refuses is asked as often as the graph declares."""
        self._activation.activate(node, say)

    def serve_once(self) -> None:
        """Serve what arrives within a moment, whatever it tells."""
        self._own.serve_once()

    def serve_for(self, duration: float) -> None:
        """Serve the graph for so many s."""
        end = time.monotonic() + duration
        self.wait_until(lambda: time.monotonic() >= end, duration + 1.0, 'a pause')

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return the last diagnostics of a node: its figures, `level` and `sentence`; empty if none came."""
        return self.verdicts.figures(node)

    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None:
        """Serve the graph until `condition`; raise `GraphError` if it breaks down or `limit` s pass."""
        begin = time.monotonic()
        try:
            while not condition():
                self._deadline.set(_LONGEST_HANG)
                self._look_after()
                if time.monotonic() - begin > limit:
                    raise GraphError(
                        f'{what} did not happen within {limit:g} s; {self.verdicts.complaints()}'
                    )
                self.serve_once()
        finally:
            self._deadline.set(0.0)

    def _look_after(self) -> None:
        """Raise `Interrupted` if asked to end; make good what has been lost, or raise that."""
        if self._interrupted:
            raise Interrupted
        try:
            self.check_processes()
            self.verdicts.check_fatal()
            if self._makes_good:
                self._check_work()
        except NodesLostError as lost:
            if not self._makes_good:
                raise
            self._make_good(lost.loss)

    def _check_work(self) -> None:
        """Raise `NodesLostError` if a node hangs, or the electronics have lost their initialisation."""
        if silent := self.verdicts.liveliness.silent(time.monotonic()):
            hanging = [group for group in self._groups if {node.full_name for node in group} & {*silent}]
            nodes = tuple(node for group in hanging for node in group)
            raise NodesLostError(Loss(nodes, silence_sentence(silent)))
        if reason := self.verdicts.needing_initialisation():
            raise NodesLostError(Loss((), reason))

    def _make_good(self, loss: Loss) -> None:
        self._makes_good = False
        try:
            self._recovery.make_good(loss)
        except GraphError as error:
            if not self.finished:
                raise
            self.notes.append(f'{error}, at the end of the drive')
        finally:
            self._makes_good = True
            self.verdicts.liveliness.pause()

    def _begin_anew(self, mount: str) -> str:
        """Initialise a mount anew while the graph runs, all if `mount` is empty; see `initialise_anew`."""
        if not self._makes_good:
            raise GraphError('the graph starts, recovers or runs in lock-step: ask when all nodes are active')
        self._makes_good = False
        try:
            return initialise_anew(self, mount)
        finally:
            self._makes_good = True
            self.verdicts.liveliness.pause()

    def mark_setter(self, say: Callable[[str], None]) -> Callable[[], None]:
        """Return the function that asks the recorder to mark this moment; `say` takes its answer."""
        return self._own.mark_setter(say)

    def transition(self, node: GraphNode, transition: int) -> None:
        """Take a node through a lifecycle transition, or raise `GraphError` with the node's own reason."""
        self._transitions.make(node, transition)

    def stop(self) -> list[str]:
        """Deactivate all nodes and end; return a sentence per unclean end."""
        self._deadline.set(_LONGEST_HANG)
        resting = [self._try_to_deactivate(node) for node in ending_order(self.nodes)]
        self.at_rest = all(resting)
        return self.leave()

    def leave(self) -> list[str]:
        """End without a word to the nodes; return a sentence per unclean end."""
        self._deadline.close()
        if not self._own.close():
            self.notes.append('the middleware of the supervisor did not come to an end and was left behind')
        remove_abandoned()
        return []

    def wait_for_service(self, node: GraphNode) -> Client:
        """Return the client of the transitions of a node when it is there."""
        client = self.client(ChangeState, f'{node.full_name}/change_state')
        self.wait_until(client.service_is_ready, _START_LIMIT, f'start of {node.full_name}')
        return client

    def refusal(self, node: GraphNode, label: str) -> GraphError:
        """Return the error of a refused transition with the node's own reason."""
        return self._transitions.refusal(node, label)

    def _try_to_deactivate(self, node: GraphNode) -> bool:
        """Return whether the node is not active any more; if not, a signal has the same effect."""
        if self.figures(node).get('state') != 'active':
            return True
        done = False
        client = self.client(ChangeState, f'{node.full_name}/change_state')
        if client.service_is_ready():
            request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
            answer = client.call_async(request)
            self._own.serve_until(answer, 2.0)
            done = answer.done() and answer.result().success
        return done

    def refuse_others(self, own: int) -> None:
        """Raise `GraphError` if there are more than `own` nodes of the same name."""
        end = time.monotonic() + 0.5  # discovery of a running graph takes less with the shipped profile
        while time.monotonic() < end:
            self.serve_once()
            if space := crowded(self.nodes, self._own.node, own):
                raise GraphError(
                    f'{space} already runs in ROS domain {self._settings.domain}: end that graph, or choose '
                    'another domain or namespace'
                )

    def wait_for_matches(self) -> None:
        """Return when every topic that a node needs has found its other side."""

        def alone() -> list[str]:
            return waiting(self.nodes, self.figures, self._own.node.get_namespace())

        try:
            self.wait_until(lambda: not alone(), _MATCH_LIMIT, 'connection of all topics')
        except GraphError as error:
            raise GraphError(f'{error}: {"; ".join(alone())}') from None

    def client(self, kind: Any, service: str) -> Client:
        """Return the client of a service, which stays until the end."""
        return self._own.client(kind, service)

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """Return the answer of a service."""
        client = self.client(kind, service)
        self.wait_until(client.service_is_ready, _START_LIMIT, f'service {service}')
        answer = client.call_async(request)
        self.wait_until(answer.done, TRANSITION_LIMIT, f'answer of {service}')
        return answer.result()
