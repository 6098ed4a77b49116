"""Brings the nodes of a graph to life and watches them, whoever has started their processes."""

import time
from collections.abc import Callable

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
from std_srvs.srv import Trigger

from mount_bringup.graph.errors import GraphError, Interrupted
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    RECORDER,
    SIM,
    GraphNode,
    GraphSettings,
    ending_order,
)
from mount_bringup.graph.pace import Pace, pace
from mount_bringup.graph.parameters import parameters_of
from mount_bringup.graph.shared_memory import remove_abandoned
from mount_ros.nodes.diagnostics import Level
from mount_ros.nodes.leaving import leave_middleware
from mount_ros.qos import publisher_qos, recording_qos
from mount_ros.topics import DIAGNOSTICS, SESSION

_START_LIMIT = 60.0  # s, chosen: a first start may compile the laws
_MATCH_LIMIT = 20.0  # s, chosen
_FRESH_DIAGNOSTICS = 1.5  # s, chosen: every node tells its figures once a second
_LATE_PATIENCE = 60.0  # s, chosen: until a machine that is too late for an activation is given up
_TRANSITION_LIMIT = 60.0  # s, chosen: activation of mount_init includes its current ramp


class Bringup:
    """The nodes of a graph as one thing: `start`, `wait_until`, and `stop`.

    Who also has their processes overrides `start_nodes` and `check_processes`.
    """

    def __init__(self, nodes: tuple[GraphNode, ...], settings: GraphSettings):
        self._nodes = nodes
        self._settings = settings
        self._interrupted = False  # no lock: a second signal may come amid the first
        self._verdicts: dict[str, dict[str, str]] = {}
        self._context = Context()
        self.notes: list[str] = []

    def interrupt(self) -> None:
        """Make every wait of the supervisor end with `Interrupted`; safe from a signal handler."""
        self._interrupted = True

    def start(
        self, session: Callable[[dict[str, dict[str, object]]], str], say: Callable[[str], None]
    ) -> None:
        """Bring all nodes to life; `session` makes the session text from all parameters of all nodes."""
        remove_abandoned()
        rclpy.init(
            context=self._context,
            domain_id=self._settings.domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        namespace = self._settings.namespace
        self._node = Node('engine_mount_supervisor', namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, recording_qos(DIAGNOSTICS)
        )
        publisher = self._node.create_publisher(String, SESSION.name, publisher_qos(SESSION))
        say('starting the nodes')
        self.start_nodes()
        for node in self._nodes:
            self.transition(node, Transition.TRANSITION_CONFIGURE)
        publisher.publish(
            String(data=session({node.name: parameters_of(node.name, self._call) for node in self._nodes}))
        )
        self._wait_for_matches()
        for node in self._nodes:
            say(f'activating {node.name}')
            self._activate(node, say)

    def start_nodes(self) -> None:
        """See to it that the nodes of this graph, and no others of their names, are there."""
        for node in self._nodes:
            self._wait_for_service(node)
        self.refuse_others(own=1)

    def check_processes(self) -> None:
        """Raise `GraphError` if a process is no more what it was."""

    def _activate(self, node: GraphNode, say: Callable[[str], None]) -> None:
        """Activate a node; one that refuses is asked as often as the graph declares.

        If the machine was late, the refusal tells nothing of the mount: it is asked again for a minute.
        """
        begin, asked = time.monotonic(), 0
        while True:
            before = self._pace()
            try:
                self.transition(node, Transition.TRANSITION_ACTIVATE)
                return
            except GraphError as error:
                self._serve_for(_FRESH_DIAGNOSTICS)
                was_late = self._pace().was_late_since(before)
                asked += not was_late
                if asked >= node.activations or time.monotonic() - begin > _LATE_PATIENCE:
                    raise
                reason = ' (this machine was too late for 1 kHz)' if was_late else ''
                self.notes.append(f'{error}{reason}; it was activated again')
                say(f'activating {node.name} again{reason}')

    def _pace(self) -> Pace:
        return pace(self.figures(DRIVER), self.figures(SIM))

    def _serve_for(self, duration: float) -> None:
        end = time.monotonic() + duration
        self.wait_until(lambda: time.monotonic() >= end, duration + 1.0, 'a pause')

    def figures(self, node: GraphNode) -> dict[str, str]:
        """Return the last diagnostics of a node: its figures, `level` and `sentence`; empty if none came."""
        return self._verdicts.get(node.name, {})

    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None:
        """Serve the graph until `condition`; raise `GraphError` if a node dies or `limit` s pass."""
        begin = time.monotonic()
        while not condition():
            if self._interrupted:
                raise Interrupted
            self.check_processes()
            self._check_verdicts()
            if time.monotonic() - begin > limit:
                raise GraphError(f'{what} did not happen within {limit:g} s; {self._complaints()}')
            self._executor.spin_once(0.05)

    def mark_setter(self, say: Callable[[str], None]) -> Callable[[], None]:
        """Return the function that asks the recorder to mark this moment; `say` takes its answer."""
        client = self._node.create_client(Trigger, f'{RECORDER.name}/mark')

        def set_mark() -> None:
            if client.service_is_ready():
                client.call_async(Trigger.Request()).add_done_callback(lambda call: say(told(call.result())))
            else:
                say('no mark was set: the recorder is not there yet')

        def told(answer: Trigger.Response) -> str:
            return 'marked' if answer.success else f'no mark was set: {answer.message}'

        return set_mark

    def transition(self, node: GraphNode, transition: int) -> None:
        """Take a node through a lifecycle transition, or raise `GraphError` with the node's own reason."""
        client = self._wait_for_service(node)
        request = ChangeState.Request(transition=Transition(id=transition))
        answer = client.call_async(request)
        label = {1: 'configure', 3: 'activate', 4: 'deactivate'}.get(transition, str(transition))
        self.wait_until(answer.done, _TRANSITION_LIMIT, f'{label} of {node.name}')
        self._node.destroy_client(client)
        if not answer.result().success:
            raise GraphError(f'{node.name} refused to {label}: {self._reason(node)}')

    def stop(self) -> list[str]:
        """Deactivate all nodes and end; return a sentence per unclean end."""
        for node in ending_order(self._nodes):
            self._try_to_deactivate(node)
        return self.leave()

    def leave(self) -> list[str]:
        """End without a word to the nodes; return a sentence per unclean end."""
        if self._context.ok() and not leave_middleware(self._take_down):
            self.notes.append('the middleware of the supervisor did not come to an end and was left behind')
        remove_abandoned()
        return []

    def _take_down(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _wait_for_service(self, node: GraphNode) -> Client:
        client = self._node.create_client(ChangeState, f'{node.name}/change_state')
        self.wait_until(client.service_is_ready, _START_LIMIT, f'start of {node.name}')
        return client

    def _reason(self, node: GraphNode) -> str:
        """Return what the node says of its refusal; it may come after the answer."""
        end = time.monotonic() + _FRESH_DIAGNOSTICS
        while int(self.figures(node).get('level', Level.OK)) < Level.ERROR and time.monotonic() < end:
            self._executor.spin_once(0.05)
        return self.figures(node).get('sentence', '(it said nothing)')

    def _try_to_deactivate(self, node: GraphNode) -> None:
        # A node that cannot is ended by a signal, to which it answers in the same way.
        if self.figures(node).get('state') != 'active':
            return
        client = self._node.create_client(ChangeState, f'{node.name}/change_state')
        if client.service_is_ready():
            request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
            self._executor.spin_until_future_complete(client.call_async(request), timeout_sec=2.0)
        self._node.destroy_client(client)

    def refuse_others(self, own: int) -> None:
        """Raise `GraphError` if there are more than `own` nodes of the same name."""
        end = time.monotonic() + 0.5  # discovery of a running graph takes less with the shipped profile
        while time.monotonic() < end:
            self._executor.spin_once(0.05)
            space = self._node.get_namespace()
            present = self._node.get_node_names_and_namespaces()
            for node in self._nodes:
                if present.count((node.name, space)) > own:
                    raise GraphError(
                        f'{node.name} already runs in ROS domain {self._settings.domain}, namespace {space}: '
                        'end that graph, or choose another domain or namespace'
                    )

    def _wait_for_matches(self) -> None:
        def all_matched() -> bool:
            return all(not self._unmatched(node) for node in self._nodes)

        try:
            self.wait_until(all_matched, _MATCH_LIMIT, 'connection of all topics')
        except GraphError as error:
            alone = '; '.join(
                f'{node.name} waits for {", ".join(self._unmatched(node))}'
                for node in self._nodes
                if self._unmatched(node)
            )
            raise GraphError(f'{error}: {alone}') from None

    def _unmatched(self, node: GraphNode) -> list[str]:
        figures = self.figures(node)
        if 'unmatched' not in figures:
            return ['its first diagnostics']
        names = {name.rsplit(self._prefix(), 1)[-1] for name in figures['unmatched'].split(', ') if name}
        return sorted(names & self._needed(node))

    def _needed(self, node: GraphNode) -> set[str]:
        if node.name != 'mount_recorder':
            return set(node.needs)
        return {name for other in self._nodes for name in other.needs} | {SESSION.name}

    def _prefix(self) -> str:
        return self._node.get_namespace().rstrip('/') + '/'

    def _call(self, kind, service, request):
        client = self._node.create_client(kind, service)
        self.wait_until(client.service_is_ready, _START_LIMIT, f'service {service}')
        answer = client.call_async(request)
        self.wait_until(answer.done, _TRANSITION_LIMIT, f'answer of {service}')
        self._node.destroy_client(client)
        return answer.result()

    def _check_verdicts(self) -> None:
        for node in self._nodes:
            figures = self.figures(node)
            if figures.get('fatal') == 'True':
                raise GraphError(f'{node.name}: {figures["sentence"]}{self._who_is_silent(figures)}')

    def _who_is_silent(self, figures: dict[str, str]) -> str:
        """Return the first node of the chain that has not handled the sample which waits for its answer."""
        waiting = figures.get('waiting_stamp', '')
        if not waiting.isdigit():
            return ''
        for node in self._nodes:
            handled = self.figures(node).get('last_stamp', '')
            if node in (DRIVER, CONTROL) and (not handled.isdigit() or int(handled) < int(waiting)):
                return f'; {node.name} does not answer'
        return ''

    def _complaints(self) -> str:
        said = [
            f'{name}: {figures["sentence"]}'
            for name, figures in self._verdicts.items()
            if int(figures['level']) >= Level.WARN
        ]
        return '; '.join(said) or 'no node complains'

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            # /diagnostics belongs to all mounts of the car
            space, _, name = status.name.rpartition('/')
            if space != self._settings.namespace.strip('/'):
                continue
            self._verdicts[name] = {
                **{value.key: value.value for value in status.values},
                'level': str(status.level[0]),
                'sentence': status.message,
            }
