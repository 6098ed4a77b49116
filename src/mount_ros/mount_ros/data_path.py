"""The 1 kHz path of a node: a plain node with publishers and raw subscriptions, and a thread that serves it.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher

from mount_ros.data_thread import DataThread, Work
from mount_ros.direct import Receiver
from mount_ros.messages.types import message_class
from mount_ros.private_rclpy import raw_publisher
from mount_ros.publishers import PublisherWatch
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import Delivery, Topic


def io_node(owner: Node, name: str = '') -> Node:
    """Return the plain node `<name>_io` that carries the data of the node `owner`, by default under its name.

    Remappings of topics on the command line hold for it too. One of the name of `owner` does not change
    `name`: other nodes know the writers of a topic by it.
    """
    return Node(
        f'{name or owner.get_name()}_io',
        namespace=owner.get_namespace(),
        context=owner.context,
        cli_args=['--ros-args', *topic_remappings(sys.argv, owner.get_name())],
        use_global_arguments=False,
        start_parameter_services=False,
        enable_rosout=False,
    )


def topic_remappings(arguments: Sequence[str], node: str) -> list[str]:
    """Return those of the command line's `arguments` that remap topics of `node`, without its name."""
    kept: list[str] = []
    for option, rule in pairwise(arguments):
        *of_node, name = rule.partition(':=')[0].split(':')
        if option in ('-r', '--remap') and of_node in ([], [node]) and not name.startswith('__'):
            kept += ['-r', rule.removeprefix(f'{node}:')]
    return kept


class DataPath:
    """Publishers and raw subscriptions of a node, served from `start` to `stop`."""

    def __init__(
        self,
        owner: Node,
        *,
        lockstep: bool = False,
        thread: DataThread | None = None,
        on_conflict: Callable[[str, str], None] = lambda confirmed, suspected: None,
        name: str = '',
    ):
        self.lockstep = lockstep
        self._thread = thread or DataThread(owner.context)
        self.node = io_node(owner, name)
        self.publisher_watch = PublisherWatch(self.node, on_conflict)
        """Who publishes what this path hears; `on_conflict` is called when others begin or cease to."""
        self._serving = False
        self._publishers: list[Publisher] = []
        self._sent_directly: list[str] = []
        self._receivers: list[Receiver] = []
        self._works: list[Work] = []
        self._stopped = False
        self.refused = 0
        """Messages and pieces of work that ended with an exception; `refusal` says what the last one was."""
        self.refusal = ''

    @property
    def name(self) -> str:
        """The full name of the node that has the topics."""
        return self.node.get_fully_qualified_name()

    @property
    def failure(self) -> str:
        """Why the thread that serves this path has ended by itself; empty while it serves."""
        return self._thread.failure

    def publisher(self, topic: Topic) -> Publisher:
        """Create a publisher of `topic`."""
        publisher = self.node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic))
        if topic.delivery is not Delivery.MARK:  # a mark without a subscriber is no loss
            self._publishers.append(publisher)
        return publisher

    def sender(self, topic: Topic, mount: str = '') -> Callable[[bytes], None]:
        """Create a publisher of `topic` and return the function that publishes its bytes, no more.

        `mount`: the namespace of one of several mounts, within that of the node.
        """
        placed = replace(topic, name=f'{mount}/{topic.name}') if mount else topic
        publisher = self.publisher(placed)
        publish = raw_publisher(publisher)
        if self.lockstep:
            return publish
        self._sent_directly.append(publisher.topic_name)
        return self._thread.direct.sender(publisher.topic_name, publish)

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None], *, directly: bool = False) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`.

        `directly`: in the sender's thread, where topic and time (not lock-step) allow it, see `direct`.
        An exception costs the message that it came with, is logged and counted; later ones are served.
        """
        kind, qos = message_class(topic.type), control_qos(topic, lockstep=self.lockstep)
        guarded = self._surviving(f'message of {topic.name} not used', callback)
        events = self._events(topic)
        if directly and not self.lockstep:
            receiver = self._thread.direct.receiver(self.node.resolve_topic_name(topic.name), guarded)
            self._receivers.append(receiver)
            guarded = receiver.take_published

        def create() -> None:
            subscription = self.node.create_subscription(
                kind, topic.name, guarded, qos, raw=True, event_callbacks=events
            )
            if topic.writers:
                self.publisher_watch.watch(topic, subscription)

        self._change(create)

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscriptions of `topic`, if there are any: no message is taken after the return.

        The node is not served meanwhile: an EventsExecutor ends by an event of a destroyed subscription.
        """
        self.publisher_watch.forget(topic)
        name = self.node.resolve_topic_name(topic.name)
        if self._serving:
            self._thread.remove(self.node)
        for subscription in [s for s in self.node.subscriptions if s.topic_name == name]:
            self.node.destroy_subscription(subscription)
        if self._serving:
            self._thread.add(self.node)

    def unmatched(self) -> list[str]:
        """Return the names of the topics whose other side has not been found yet.

        Data sent before both sides have found each other is lost silently.
        """
        alone = [s.topic_name for s in self.node.subscriptions if s.get_publisher_count() == 0]
        alone += [p.topic_name for p in self._publishers if p.get_subscription_count() == 0]
        return sorted(set(alone))

    def start(self) -> None:
        """Begin to serve the subscriptions."""
        self._serving = True
        self._thread.add(self.node)

    def add_poll(self, work: Work) -> None:
        """Let the thread that serves the messages do `work` too, between them, again and again.

        For lock-step in one process: work that only continues what happens in this thread.
        """
        self._works.append(self._surviving('work not done', work))
        self._thread.add_poll(self._works[-1])

    def remove_polls(self) -> None:
        """Return when none of the attended work is done any more."""
        while self._works:
            self._thread.remove_poll(self._works[-1])  # where this is refused the work goes on
            self._works.pop()

    def stop(self) -> None:
        """End serving and destroy the node; safe to call twice."""
        if self._stopped:
            return
        self._stopped = True
        self.remove_polls()
        for receiver in self._receivers:
            receiver.end()
        if self._serving:
            self._thread.remove(self.node)
        for name in self._sent_directly:
            self._thread.direct.end_sender(name)
        self.publisher_watch.end()
        self.node.destroy_node()

    def _events(self, topic: Topic) -> SubscriptionEventCallbacks | None:
        """Return what is done when a publisher comes or goes; a thread that polls does not hear it."""
        if not topic.writers:
            return None
        trouble, watch = f'writers of {topic.name} not known', self.publisher_watch
        noticed = self._surviving(trouble, lambda _: watch.notice(topic))
        return SubscriptionEventCallbacks(matched=noticed)

    def _change(self, make: Callable[[], Any]) -> None:
        """Change what the thread may be serving."""
        if self._serving:
            self._thread.change(make)
        else:
            make()

    def _surviving(self, trouble: str, callback: Callable[..., Any]) -> Callable[..., Any]:
        # The border of the data thread: an exception would end it, and with it every node that it serves.
        logger = self.node.get_logger()

        def guarded(*arguments: Any) -> Any:
            try:
                return callback(*arguments)
            except Exception as error:
                self.refused += 1
                self.refusal = f'{trouble}: {type(error).__name__}: {error}'
                logger.error(self.refusal, throttle_duration_sec=1.0)
                return False

        return guarded
