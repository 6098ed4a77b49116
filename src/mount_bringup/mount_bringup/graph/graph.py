"""The nodes of a graph as the supervisor reaches them: by services, diagnostics and the topic `session`."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from mount_bringup.graph.nodes import DRIVER, RECORDER, GraphError, GraphNode, GraphSettings, name_in
from mount_bringup.graph.reports import NodeReports
from mount_bringup.graph.shutdown import Interrupted
from mount_ros.messages.event import read_mark
from mount_ros.nodes.diagnostics import Level
from mount_ros.nodes.shutdown import end_after, leave_middleware
from mount_ros.publishers import present_nodes
from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS, EVENT, SESSION

FRESH_DIAGNOSTICS = 1.5
"""Seconds (chosen): every node reports once a second."""
CONFIGURE, ACTIVATE, DEACTIVATE = 'configure', 'activate', 'deactivate'
_TRANSITIONS = {
    CONFIGURE: Transition.TRANSITION_CONFIGURE,
    ACTIVATE: Transition.TRANSITION_ACTIVATE,
    DEACTIVATE: Transition.TRANSITION_DEACTIVATE,
}
ANSWER_LIMIT = 60.0
"""Seconds (chosen) until a node answers: a first start may compile the laws, an activation has its ramp."""
_DEACTIVATION_LIMIT = 2.0  # s, chosen: then a signal has the same effect
_MATCH_LIMIT = 20.0  # s, chosen
_DISCOVERY = 0.5  # s, chosen: discovery of a running graph takes less with the shipped profile
LONGEST_HANG = 30.0
"""Seconds (chosen) until this process ends if it hangs; its nodes then go to 0 A by themselves."""
_PERIOD = 0.05  # s, chosen


class Graph:
    """A node in the middleware without a thread of its own: messages wait for one of the waits here."""

    def __init__(self, nodes: Sequence[GraphNode], settings: GraphSettings):
        self.nodes = tuple(nodes)
        self.settings = settings
        self.mounts = list(dict.fromkeys(node.mount for node in nodes if node.is_a(DRIVER))) or ['']
        self.reports = NodeReports(self.nodes, settings.namespace)
        self.figures = self.reports.figures
        self.notes: list[str] = []
        """Sentences for the user about what was not as it should be."""
        self.repeats: dict[str, list[str]] = {}
        """The reasons why a node was activated again."""
        self._interrupted = False  # no lock: a second signal may come during the first
        self._context = Context()
        self._clients: dict[str, Client] = {}

    def open(self) -> None:
        """Join the middleware and receive diagnostics and marks."""
        try:
            rclpy.init(
                args=[],  # of this command, of which none is for ROS
                context=self._context,
                domain_id=self.settings.domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except RuntimeError as error:
            raise GraphError(f'the middleware does not start: {error}') from None
        name, namespace = 'engine_mount_supervisor', self.settings.namespace
        self.node = Node(name, namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        subscribe = self.node.create_subscription
        subscribe(DiagnosticArray, DIAGNOSTICS.name, self.reports.take, publisher_qos(DIAGNOSTICS))
        for mount in dict.fromkeys(['', *self.mounts]):  # the recorder of several mounts marks for all
            take = partial(self._take_event, mount)
            subscribe(String, name_in(mount, EVENT.name), take, publisher_qos(EVENT))
        self._sessions = {
            mount: self.node.create_publisher(String, name_in(mount, SESSION.name), publisher_qos(SESSION))
            for mount in self.mounts
        }

    def close(self) -> None:
        """Leave the middleware."""
        end_after(0.0)
        if self._context.ok() and not leave_middleware(self._take_down):
            self.notes.append('the middleware of the supervisor did not come to an end and was left behind')

    def interrupt(self) -> None:
        """Make every wait end with `Interrupted`; safe in a signal handler."""
        self._interrupted = True

    def check(self) -> None:
        """Raise the reason why a wait must end."""
        if self._interrupted:
            raise Interrupted

    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None:
        """Serve the graph until `condition`; raise `GraphError` if it breaks down or `limit` s pass."""
        begin = time.monotonic()
        try:
            while not condition():
                end_after(LONGEST_HANG)
                self.check()
                if time.monotonic() - begin > limit:
                    raise GraphError(f'{what} did not happen within {limit:g} s; {self.reports.complaints()}')
                self.serve_once()
        finally:
            end_after(0.0)

    def serve_for(self, duration: float) -> None:
        """Serve the graph for so many s."""
        end = time.monotonic() + duration
        self.wait_until(lambda: time.monotonic() >= end, duration + 1.0, 'a pause')

    def serve_once(self) -> None:
        """Take the messages of a moment, without a check."""
        self._executor.spin_once(_PERIOD)

    def fresh_figures(self, node: GraphNode) -> dict[str, str]:
        """Return the next report of a node."""
        self.reports.forget(node)
        self.wait_until(lambda: bool(self.figures(node)), 5.0, f'a report of {node.full_name}')
        return self.figures(node)

    def client(self, kind: Any, service: str) -> Client:
        """Return the client of a service, which stays until the end.

        Fast DDS has been seen to wait for itself for ever where an endpoint was destroyed.
        """
        if service not in self._clients:
            self._clients[service] = self.node.create_client(kind, service)
        return self._clients[service]

    def call(self, kind: Any, service: str, **fields: Any) -> Any:
        """Return the answer of a service to a request with these fields."""
        client = self.client(kind, service)
        self.wait_until(client.service_is_ready, ANSWER_LIMIT, f'service {service}')
        answer = client.call_async(kind.Request(**fields))
        self.wait_until(answer.done, ANSWER_LIMIT, f'answer of {service}')
        return answer.result()

    def parameters_of(self, node: GraphNode) -> dict[str, object]:
        """Return {name: value} of a running node."""
        names = sorted(self.call(ListParameters, f'{node.full_name}/list_parameters').result.names)
        values = self.call(GetParameters, f'{node.full_name}/get_parameters', names=names).values
        return dict(zip(names, map(parameter_value_to_python, values), strict=True))

    def change_states(self, nodes: Sequence[GraphNode], transition: str) -> dict[GraphNode, str]:
        """Take nodes through a transition side by side; return {node: reason} of those that refuse."""
        for node in nodes:
            ready = self.client(ChangeState, f'{node.full_name}/change_state').service_is_ready
            self.wait_until(ready, ANSWER_LIMIT, f'start of {node.full_name}')
        answers = {node: self._request(node, transition) for node in nodes}
        what = f'{transition} of {", ".join(node.full_name for node in nodes)}'
        self.wait_until(lambda: all(answer.done() for answer in answers.values()), ANSWER_LIMIT, what)
        refused = [node for node, answer in answers.items() if not answer.result().success]
        return {node: f'{node.full_name} refused to {transition}: {self._reason(node)}' for node in refused}

    def transition(self, nodes: Sequence[GraphNode], transition: str) -> None:
        """Take nodes through a transition, or raise `GraphError` with the reason of the first refusal."""
        for refusal in self.change_states(nodes, transition).values():
            raise GraphError(refusal)
        for node in nodes if transition == CONFIGURE else ():
            self.reports.observer.on_state(node, 'configured')

    def deactivate(self, node: GraphNode) -> None:
        """Deactivate a node if it is active."""
        state = self.call(GetState, f'{node.full_name}/get_state').current_state
        if state.id == State.PRIMARY_STATE_ACTIVE:
            self.transition([node], DEACTIVATE)

    def try_to_deactivate(self, node: GraphNode) -> bool:
        """Return whether the node is not active any more, without a wait for a node that hangs."""
        if self.figures(node).get('state') != 'active':
            return True
        if not self.client(ChangeState, f'{node.full_name}/change_state').service_is_ready():
            return False
        answer = self._request(node, DEACTIVATE)
        self._executor.spin_until_future_complete(answer, timeout_sec=_DEACTIVATION_LIMIT)
        return answer.done() and answer.result().success

    def refuse_other_graph(self) -> None:
        """Raise `GraphError` if nodes of these names run already."""
        end = time.monotonic() + _DISCOVERY
        space = self.node.get_namespace().rstrip('/')
        places = {(node.name, f'{space}/{node.mount}'.rstrip('/') or '/') for node in self.nodes}
        while time.monotonic() < end:
            self.serve_once()
            for name, own_space in places.intersection(present_nodes(self.node)):
                raise GraphError(
                    f'{name} in namespace {own_space} already runs in ROS domain {self.settings.domain}: end '
                    'that graph, or choose another domain or namespace'
                )

    def wait_for_matches(self) -> None:
        """Wait until every topic that a node needs has found its other side."""
        try:
            self.wait_until(lambda: not self._waiting(), _MATCH_LIMIT, 'connection of all topics')
        except GraphError as error:
            raise GraphError(f'{error}: {"; ".join(self._waiting())}') from None

    def publish_session(self, mount: str, text: str) -> None:
        """Publish the session of a mount."""
        self._sessions[mount].publish(String(data=text))

    def missing_topics(self, node: GraphNode) -> list[str]:
        """Return the topics that a node needs and that have no other side yet, by its own figures."""
        figures = self.figures(node)
        if 'unmatched' not in figures:
            return ['its first diagnostics']
        needed = {name_in(node.mount, name) for name in node.needs}
        if node.is_a(RECORDER):
            needed = {name_in(other.mount, name) for other in self.nodes for name in other.needs}
            needed |= {name_in(mount, SESSION.name) for mount in self.mounts}
        space = f'/{self.settings.namespace}'.replace('//', '/').rstrip('/')
        return sorted({f'{space}/{name}' for name in needed} & {*figures['unmatched'].split(', ')})

    def _waiting(self) -> list[str]:
        """Return in words which nodes wait for which topics."""
        lacking = {node.full_name: self.missing_topics(node) for node in self.nodes}
        return [f'{name} waits for {", ".join(topics)}' for name, topics in lacking.items() if topics]

    def _request(self, node: GraphNode, transition: str) -> Any:
        request = ChangeState.Request(transition=Transition(id=_TRANSITIONS[transition]))
        return self.client(ChangeState, f'{node.full_name}/change_state').call_async(request)

    def _reason(self, node: GraphNode) -> str:
        """Return the reason of a refusal; its report may come after the answer."""
        end = time.monotonic() + FRESH_DIAGNOSTICS
        while int(self.figures(node).get('level', Level.OK)) < Level.ERROR and time.monotonic() < end:
            self.serve_once()
        return self.figures(node).get('sentence', '(no report)')

    def _take_event(self, mount: str, message: String) -> None:
        self.reports.observer.on_mark(mount, read_mark(message.data, 0))

    def _take_down(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)
