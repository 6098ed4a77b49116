"""The 1 kHz path of a node: a plain node of its own on an EventsExecutor in a thread of its own.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation.
"""

import threading
from collections.abc import Callable

from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from mount_ros.message_types import message_class
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import Topic

_SPIN_PERIOD = 0.2  # s: how often the thread looks whether it shall end
_REST_PERIOD = 0.05  # s, chosen


class DataPath:
    """Publishers and raw subscriptions of a node, served by one thread from `start` to `stop`."""

    def __init__(self, owner: Node, *, lockstep: bool = False):
        self.lockstep = lockstep
        self.node = Node(
            f'{owner.get_name()}_io',
            namespace=owner.get_namespace(),
            context=owner.context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._context: Context = owner.context
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._resting = threading.Event()
        self._publishers: list[Publisher] = []
        self._subscriptions: list[Subscription] = []

    def publisher(self, topic: Topic) -> Publisher:
        """Create a publisher of `topic`; publish messages or their serialised bytes with it."""
        publisher = self.node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic))
        self._publishers.append(publisher)
        return publisher

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`."""
        subscription = self.node.create_subscription(
            message_class(topic.type),
            topic.name,
            callback,
            control_qos(topic, lockstep=self.lockstep),
            raw=True,
        )
        self._subscriptions.append(subscription)

    def unmatched(self) -> list[str]:
        """Return the names of the topics that nobody on the other side has been found for yet.

        Data sent before both sides have found each other is lost without a word.
        """
        alone = [s.topic_name for s in self._subscriptions if s.get_publisher_count() == 0]
        alone += [p.topic_name for p in self._publishers if p.get_subscription_count() == 0]
        return sorted(set(alone))

    def start(self) -> None:
        """Begin to serve the subscriptions."""
        self._thread = threading.Thread(target=self._serve, name=self.node.get_name(), daemon=True)
        self._thread.start()

    def rest(self) -> None:
        """From now on only look at what came last, a few times a second: nobody waits for an answer."""
        self._resting.set()

    def wake(self) -> None:
        """Serve each message at once again."""
        self._resting.clear()

    def stop(self) -> None:
        """End the thread and destroy the node; safe to call twice."""
        if self._ending.is_set():
            return
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        self.node.destroy_node()

    @property
    def _serving(self) -> bool:
        return not self._ending.is_set() and self._context.ok()

    def _serve(self) -> None:
        while self._serving:
            if self._resting.is_set():
                self._look_seldom()
            else:
                self._execute()

    def _execute(self) -> None:
        executor = EventsExecutor(context=self._context)
        executor.add_node(self.node)
        # spin() of this executor dispatches nothing in the pinned wheels; spin_once does.
        while self._serving and not self._resting.is_set():
            executor.spin_once(_SPIN_PERIOD)
        executor.remove_node(self.node)

    def _look_seldom(self) -> None:
        while self._resting.is_set() and not self._ending.wait(_REST_PERIOD):
            for subscription in self._subscriptions:
                with subscription.handle:
                    while (
                        taken := subscription.handle.take_message(subscription.msg_type, True)
                    ) is not None:
                        subscription.callback(taken[0])
