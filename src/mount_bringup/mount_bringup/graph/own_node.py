"""The node of the supervisor itself: hears the graph, tells it the session, and asks its services."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import RECORDER, GraphSettings
from mount_bringup.graph.verdicts import Verdicts
from mount_ros.messages.event import read_mark
from mount_ros.nodes.shutdown import leave_middleware
from mount_ros.qos import publisher_qos, recording_qos
from mount_ros.topics import DIAGNOSTICS, EVENT, SESSION

_MOMENT = 0.05  # s, chosen


class OwnNode:
    """A node without a thread of its own: what arrives waits for `serve_once`."""

    node: Node
    """There from `open` to `close`."""

    def __init__(self, settings: GraphSettings, mounts: Sequence[str], verdicts: Verdicts):
        self._settings, self._mounts, self._verdicts = settings, mounts, verdicts
        self._context = Context()
        self._sessions: dict[str, Publisher] = {}
        self._clients: dict[str, Client] = {}
        self._executor: SingleThreadedExecutor | None = None

    def open(self) -> None:
        """Join the middleware; from then on `verdicts` takes diagnostics and marks."""
        try:
            rclpy.init(
                context=self._context,
                domain_id=self._settings.domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except RuntimeError as error:
            raise GraphError(f'the middleware does not start: {error}') from None
        namespace = self._settings.namespace
        self.node = Node('engine_mount_supervisor', namespace=namespace, context=self._context)
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(self.node)
        self._executor = executor
        self.node.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._verdicts.take, recording_qos(DIAGNOSTICS)
        )
        for mount in dict.fromkeys(['', *self._mounts]):  # the recorder of several mounts marks for all
            name, take = f'{mount}/{EVENT.name}'.lstrip('/'), partial(self._take_event, mount)
            self.node.create_subscription(String, name, take, recording_qos(EVENT))
        qos = publisher_qos(SESSION)
        for mount in self._mounts:
            name = f'{mount}/{SESSION.name}'.lstrip('/')
            self._sessions[mount] = self.node.create_publisher(String, name, qos)

    def close(self) -> bool:
        """Leave the middleware; return whether it came to an end."""
        return not self._context.ok() or leave_middleware(self._take_down)

    def serve_once(self) -> None:
        """Serve what arrives within a moment, whatever it tells."""
        assert self._executor is not None
        self._executor.spin_once(_MOMENT)

    def serve_until(self, answer: Future, limit: float) -> None:
        """Serve what arrives until `answer` is there, or `limit` s have passed."""
        assert self._executor is not None
        self._executor.spin_until_future_complete(answer, timeout_sec=limit)

    def tell_session(self, mount: str, text: str) -> None:
        """Publish the session of a mount."""
        self._sessions[mount].publish(String(data=text))

    def client(self, kind: Any, service: str) -> Client:
        """Return the client of a service, which stays until the end.

        Fast DDS has been seen to wait for itself for ever where an endpoint was destroyed.
        """
        if service not in self._clients:
            self._clients[service] = self.node.create_client(kind, service)
        return self._clients[service]

    def mark_setter(self, say: Callable[[str], None]) -> Callable[[], None]:
        """Return the function that asks the recorder to mark this moment; `say` takes its answer."""
        client = self.client(Trigger, f'{RECORDER.name}/mark')

        def set_mark() -> None:
            if client.service_is_ready():
                client.call_async(Trigger.Request()).add_done_callback(lambda call: say(told(call.result())))
            else:
                say('no mark was set: the recorder is not there yet')

        def told(answer: Trigger.Response) -> str:
            return 'marked' if answer.success else f'no mark was set: {answer.message}'

        return set_mark

    def _take_event(self, mount: str, message: String) -> None:
        self._verdicts.witness.mark(mount, read_mark(message.data, 0))

    def _take_down(self) -> None:
        if self._executor is not None:
            self._executor.shutdown()
            self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)
