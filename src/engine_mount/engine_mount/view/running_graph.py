"""The feed of a running graph: the topics of one mount, by a node of its own."""

from functools import partial

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from engine_mount.view.feed import Fail, FeedError, Message, Receive
from mount_recorder.collector import Collector
from mount_ros.environment import loopback_refusal, prepare_environment
from mount_ros.qos import control_qos
from mount_ros.topics import TOPICS, Topic

_PERIOD = 0.02  # s, chosen: less than a picture of the page


class RunningGraph:
    """The graph of one mount in a ROS domain and namespace."""

    def __init__(self, domain: int, namespace: str = ''):
        """Raises `FeedError` where no process can reach another."""
        if refusal := loopback_refusal():
            raise FeedError(refusal)
        prepare_environment()
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node(
            'engine_mount_view', namespace=namespace, context=self._context, enable_rosout=False
        )
        self._collector: Collector | None = None
        self.topics = {self._node.resolve_topic_name(topic.name): topic for topic in TOPICS}
        self.title = f'running graph, ROS domain {domain}, namespace {self._node.get_namespace()}'
        self.zero: int | None = None
        self._stopped = False

    def start(self, receive: Receive, on_failure: Fail) -> None:
        """Begin to take messages."""
        self._collector = Collector(self._node, period=_PERIOD, on_failure=on_failure)
        for topic in TOPICS:
            hand_over = partial(_hand_over, receive, topic)
            self._collector.collect(topic, hand_over, control_qos(topic, lockstep=False))
        self._collector.start()

    def stop(self) -> None:
        """End the subscriptions and leave the middleware."""
        if self._stopped:
            return
        self._stopped = True
        if self._collector is not None:
            self._collector.stop()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


def _hand_over(receive: Receive, topic: Topic, raw: bytes, received: int, sent: int) -> None:
    receive(Message(topic, raw, received, sent))
