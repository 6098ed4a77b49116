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

from mount_bringup.graph.nodes import (
    DRIVER,
    INIT,
    RECORDER,
    Figures,
    GraphError,
    GraphNode,
    GraphSettings,
    name_in,
)
from mount_bringup.graph.shutdown import Interrupted
from mount_ros.messages.event import Mark, read_mark
from mount_ros.messages.verdicts import Level, flags_of, verdicts_in
from mount_ros.nodes.shutdown import end_after, leave_middleware
from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS, EVENT, SESSION

FRESH_DIAGNOSTICS = 1.5
"""Seconds (chosen): every node reports once a second."""
CONFIGURE, ACTIVATE, DEACTIVATE = 'configure', 'activate', 'deactivate'
ANSWER_LIMIT = 60.0
"""Seconds (chosen) until a node answers: a first start may compile the laws, an activation has its ramp."""
LATE_PATIENCE = 60.0  # s, chosen: until a machine that is too late for an activation is given up
_INIT_ATTEMPTS = 2  # chosen
_DEACTIVATION_LIMIT = 2.0  # s, chosen: then a signal has the same effect
_MATCH_LIMIT = 20.0  # s, chosen
LONGEST_HANG = 30.0
"""Seconds (chosen) until this process ends if it hangs; its nodes then go to 0 A by themselves."""
SILENCE_LIMIT = 4.0
"""Seconds (chosen) without diagnostics, which come once a second, until a node is treated as failed."""
_PERIOD = 0.05  # s, chosen
_LONGEST_PAUSE = 0.5  # s, chosen: ten times this period


class GraphObserver:
    """Receives events of the graph; this one ignores them."""

    def on_state(self, node: GraphNode, state: str) -> None:
        """Receive that a node is `configured`, `activating` or `active` from now on."""

    def on_report(self, name: str, figures: Figures) -> None:
        """Receive a report of the node of this full name."""

    def on_mark(self, mount: str, mark: Mark) -> None:
        """Receive a mark on the topic `event` of a mount."""


class Graph:
    """A node in the middleware without a thread of its own: messages wait for one of the waits here."""

    def __init__(self, nodes: Sequence[GraphNode], settings: GraphSettings):
        self.nodes = tuple(nodes)
        self.settings = settings
        self.mounts = list(dict.fromkeys(node.mount for node in nodes if node.is_a(DRIVER))) or ['']
        self.observer = GraphObserver()
        self._figures: dict[str, dict[str, str]] = {}
        self._reported: dict[str, float] = {}  # s, steady clock
        self._checked = float('inf')
        self.notes: list[str] = []
        """Sentences for the user about what was not as it should be."""
        self.repeats: dict[str, str] = {}
        """The last reason why a node was activated again."""
        self._interrupted = False  # no lock: a second signal may come during the first
        self._context = Context()
        self._clients: dict[str, Client] = {}

    def open(self) -> None:
        """Join the middleware and receive diagnostics and marks."""
        rclpy.init(
            args=[],  # of this command, of which none is for ROS
            context=self._context,
            domain_id=self.settings.domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self.node = Node('engine_mount_supervisor', namespace=self.settings.namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        subscribe = self.node.create_subscription
        subscribe(DiagnosticArray, DIAGNOSTICS.name, self._take_report, publisher_qos(DIAGNOSTICS))
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
        if self._context.ok():
            leave_middleware(self._take_down)

    def interrupt(self) -> None:
        """Make every wait end with `Interrupted`; safe in a signal handler."""
        self._interrupted = True

    def check(self) -> None:
        """Raise the reason why a wait must end."""
        if self._interrupted:
            raise Interrupted('the coil is at 0 A')

    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None:
        """Serve the graph until `condition`; raise `GraphError` if it breaks down or `limit` s pass."""
        begin = time.monotonic()
        try:
            while not condition():
                end_after(LONGEST_HANG)
                self.check()
                if time.monotonic() - begin > limit:
                    raise GraphError(f'{what} did not happen within {limit:g} s: read the logs')
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
        self.forget(node)
        self.wait_until(lambda: bool(self.figures(node)), 5.0, f'a report of {node.full_name}')
        return self.figures(node)

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return the last report of a node: its figures, `level` and `sentence`; empty if there is none."""
        return self._figures.get(node.full_name, {})

    def note_active(self, node: GraphNode) -> None:
        """Note the activation of a node, which the node itself reports a moment later."""
        self._figures.setdefault(node.full_name, {'level': '0', 'sentence': ''})['state'] = 'active'
        self.observer.on_state(node, 'active')

    def forget(self, node: GraphNode) -> None:
        """Forget the report of a node, which is no longer true, and expect none until the next."""
        self._figures.pop(node.full_name, None)
        self._reported.pop(node.full_name, None)

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
            self.observer.on_state(node, 'configured')

    def activate(
        self, nodes: Sequence[GraphNode], report: Callable[[str], None] = lambda sentence: None
    ) -> None:
        """Activate nodes side by side; raise `GraphError` where one refuses, `mount_init` a second time.

        A refusal does not count while the machine was late for setpoints, for a minute, nor while the driver
        requests a new initialisation: the driver is deactivated and activated first.
        """
        begin, remaining = (
            time.monotonic(),
            {node: _INIT_ATTEMPTS if node.is_a(INIT) else 1 for node in nodes},
        )
        report(f'activating {", ".join(node.full_name for node in nodes)}')
        for node in nodes:
            self.observer.on_state(node, 'activating')
        while remaining:
            before = {node: self._late_setpoints(node) for node in remaining}
            refused = self.change_states([*remaining], ACTIVATE)
            for node in remaining.keys() - refused.keys():
                self.note_active(node)
            if refused:
                self.serve_for(FRESH_DIAGNOSTICS)
            for node, refusal in refused.items():
                driver = self._driver(node)
                figures, late = self.figures(driver), self._late_setpoints(node) > before[node]
                renewed = node != driver and flags_of(figures).needs_initialisation
                remaining[node] -= not (late or renewed)
                if not remaining[node] or time.monotonic() - begin > LATE_PATIENCE:
                    raise GraphError(refusal)
                if late:
                    refusal = f'{refusal} (this machine was too late for setpoints)'
                self.repeats[node.full_name] = refusal
                report(f'activating {node.full_name} again: {refusal}')
                if renewed:  # before that the driver sends no setpoint
                    self.repeats[driver.full_name] = figures['sentence']
                    self.transition([driver], DEACTIVATE)
                    self.forget(driver)  # the report is of the activation before
                    self.transition([driver], ACTIVATE)
                    self.note_active(driver)
            remaining = {node: remaining[node] for node in refused}

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

    def wait_for_matches(self) -> None:
        """Wait until every topic that a node needs has found its other side."""
        lacking: dict[str, list[str]] = {}

        def matched() -> bool:
            lacking.clear()
            lacking.update({node.full_name: self.missing_topics(node) for node in self.nodes})
            return not any(lacking.values())

        try:
            self.wait_until(matched, _MATCH_LIMIT, 'connection of all topics')
        except GraphError as error:
            waiting = [f'{name} waits for {", ".join(topics)}' for name, topics in lacking.items() if topics]
            raise GraphError(f'{error}; {"; ".join(waiting)}') from None

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

    def _driver(self, node: GraphNode) -> GraphNode:
        """Return the driver of the mount of a node."""
        return next((each for each in self.nodes if each.is_a(DRIVER) and each.mount == node.mount), DRIVER)

    def _late_setpoints(self, node: GraphNode) -> int:
        """Return how many setpoints came too late for the driver of its mount."""
        return int(self.figures(self._driver(node)).get('late_setpoints', 0))

    def _request(self, node: GraphNode, transition: str) -> Any:
        request = ChangeState.Request(transition=Transition(label=transition))
        return self.client(ChangeState, f'{node.full_name}/change_state').call_async(request)

    def _reason(self, node: GraphNode) -> str:
        """Return the reason of a refusal; its report may come after the answer."""
        end = time.monotonic() + FRESH_DIAGNOSTICS
        while int(self.figures(node).get('level', Level.OK)) < Level.ERROR and time.monotonic() < end:
            self.serve_once()
        return self.figures(node).get('sentence', '(no report)')

    def _take_report(self, message: DiagnosticArray) -> None:
        """Take a message of `/diagnostics`, which all mounts of the car share."""
        space = f'{self.settings.namespace.strip("/")}/'.lstrip('/')
        known = {f'{space}{node.full_name}': node.full_name for node in self.nodes}
        for report in verdicts_in(message):
            if name := known.get(report.node):
                figures = {**report.figures, 'level': str(report.level), 'sentence': report.sentence}
                self._reported[name], self._figures[name] = time.monotonic(), figures
                self.observer.on_report(name, figures)

    def _take_event(self, mount: str, message: String) -> None:
        self.observer.on_mark(mount, read_mark(message.data, 0))

    def _take_down(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)
