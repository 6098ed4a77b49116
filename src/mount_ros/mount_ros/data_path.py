"""The 1 kHz path of a node: a plain node with publishers and raw subscriptions, and a thread that serves it.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation.

A topic between two nodes of a process costs two changes of thread by way of the middleware. Directly it costs
a call, in the sender's thread and before the message is published for the recorder and all others.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from rclpy.waitable import Waitable

from mount_ros.data_thread import DataThread, LocalTopic, Poll
from mount_ros.messages.cdr import message_class
from mount_ros.nodes.parameters import USE_SIM_TIME
from mount_ros.private_rclpy import raw_publisher
from mount_ros.publishers import PublisherWatch
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import TOPICS, Delivery, Topic


class _DataNode(Node):
    """A node without events of its publishers and subscriptions.

    An EventsExecutor that lets go of one whose event is still queued destroys Python objects without the
    interpreter: a segmentation fault within seconds where writers come and go (rclpy 7.1, its issue 1644).
    """

    @property
    def waitables(self) -> Iterator[Waitable]:
        yield from ()


def io_node(owner: Node, name: str = '') -> Node:
    """Return the plain node `<name>_io` that carries the data of the node `owner`, by default under its name.

    Remappings of topics on the command line hold for it too. One of the name of `owner` does not change
    `name`: other nodes know the writers of a topic by it.
    """
    return _DataNode(
        f'{name or owner.get_name()}_io',
        namespace=owner.get_namespace(),
        context=owner.context,
        cli_args=['--ros-args', '-r', f'__node:={name or owner.get_name()}_io'],
        start_parameter_services=False,
        enable_rosout=False,
        parameter_overrides=[Parameter(USE_SIM_TIME, value=False)],  # also where all nodes are given true
    )


class DataPath:
    """Publishers and raw subscriptions of a node, served from `start` to `stop`.

    An exception costs the message or the poll in which it is raised: it is logged and counted in `refused`,
    `refusal` is the last one, and later messages are served.
    """

    def __init__(
        self,
        owner: Node,
        *,
        lockstep: bool = False,
        thread: DataThread | None = None,
        on_conflict: Callable[[str, str], None] = lambda confirmed, suspected: None,
        on_failure: Callable[[str], None] = lambda sentence: None,
        name: str = '',
    ):
        """Take a `thread` that other nodes share, or none: then `on_failure` takes how its own one ended."""
        self.lockstep = lockstep
        self.refused, self.refusal = 0, ''
        self._thread = thread or DataThread(owner.context, on_failure)
        self._direct = thread is not None and thread.shared and not lockstep
        self.node = io_node(owner, name)
        self.publisher_watch = PublisherWatch(self.node, on_conflict)
        """Who publishes the subscribed topics; `on_conflict` is called when others begin or cease to."""
        self._serving, self._stopped = False, False
        self._publishers: list[Publisher] = []
        self._optional: set[str] = set()  # full names of subscribed topics that may have no publisher
        self._senders, self._receivers = ExitStack(), ExitStack()  # what passes directly, and ends with it
        self._polls: list[Poll] = []

    @property
    def name(self) -> str:
        """The full name of the node that has the topics."""
        return self.node.get_fully_qualified_name()

    @property
    def failure(self) -> str:
        """Why the thread that serves this path has ended by itself; empty while it serves."""
        return self._thread.failure

    def publisher(self, topic: Topic, mount: str = '') -> Publisher:
        """Create a publisher of `topic`; `mount` is the namespace of one of several mounts."""
        name = f'{mount}/{topic.name}' if mount else topic.name
        publisher = self.node.create_publisher(message_class(topic.type), name, publisher_qos(topic))
        if topic.delivery is not Delivery.MARK:  # a mark without a subscriber is no loss
            self._publishers.append(publisher)
        return publisher

    def sender(self, topic: Topic, mount: str = '') -> Callable[[bytes], None]:
        """Create a publisher of `topic` and return the function that publishes its bytes, no more."""
        publisher = self.publisher(topic, mount)
        publish = raw_publisher(publisher)
        if not self._direct:
            return publish
        local = self._thread.local_topics[publisher.topic_name]
        local.senders.append(publisher)
        self._senders.callback(local.senders.remove, publisher)

        def send(raw: bytes) -> None:
            for receive in local.receivers:
                receive(raw, True)
            publish(raw)

        return send

    def subscribe(
        self,
        topic: Topic,
        callback: Callable[[bytes], None],
        *,
        directly: bool = False,
        on_conflict: Callable[[str, str], None] | None = None,
    ) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`.

        `directly`: in the thread of a sender in this process, where time (not lock-step) allows it.
        `on_conflict`: the topic is optional, and its other publishers are reported to this function alone.
        """

        def create() -> None:
            kind, qos = message_class(topic.type), control_qos(topic, lockstep=self.lockstep)
            subscription = self.node.create_subscription(kind, topic.name, callback, qos, raw=True)
            watch = self.publisher_watch
            if on_conflict:
                watch = PublisherWatch(self.node, on_conflict)
                self._optional.add(subscription.topic_name)
            direct = directly and self._direct
            subscription.callback = self._receiver(topic, subscription, callback, watch, direct)

        if self._serving:
            self._thread.change(create)
        else:
            create()

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscriptions of `topic`, if there are any: no message is taken after the return.

        The node is not served meanwhile: an EventsExecutor ends by an event of a destroyed subscription.
        """
        self.publisher_watch.remove(topic)
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
        subscribed = [s for s in self.node.subscriptions if s.topic_name not in self._optional]
        alone = [s.topic_name for s in subscribed if s.get_publisher_count() == 0]
        alone += [p.topic_name for p in self._publishers if p.get_subscription_count() == 0]
        return sorted(set(alone))

    def start(self) -> None:
        """Begin to serve the subscriptions."""
        self._serving = True
        self._thread.add(self.node)

    def add_poll(self, poll: Poll) -> None:
        """Let the thread that serves the messages call `poll` too, between them, again and again.

        For lock-step in one process: work that only continues what happens in this thread.
        """
        self._polls.append(self._guarded(poll))
        self._thread.add_poll(self._polls[-1])

    def remove_polls(self) -> None:
        """Return when no poll of this path is called any more."""
        while self._polls:
            self._thread.remove_poll(self._polls[-1])  # where this is refused the poll goes on
            self._polls.pop()

    def stop(self) -> None:
        """End serving and destroy the node; safe to call twice."""
        if self._stopped:
            return
        self._stopped = True
        self.remove_polls()
        self._receivers.close()
        if self._serving:
            self._thread.remove(self.node)
        self._senders.close()
        self.publisher_watch.remove(*TOPICS)
        self.node.destroy_node()

    def _receiver(
        self,
        topic: Topic,
        subscription: Subscription,
        callback: Callable[[bytes], None],
        watch: PublisherWatch,
        directly: bool,
    ) -> Callable[..., None]:
        """Return the function that takes a message, and lets no exception end the thread or the sender."""
        watched = watch.add(topic, subscription) if topic.writers else None
        count_publishers = subscription.get_publisher_count
        local = self._thread.local_topics[subscription.topic_name] if directly else LocalTopic()
        one_at_a_time, trouble = threading.RLock(), f'message of {topic.name} not used'

        def receive(raw: bytes, directly: bool = False) -> None:
            with one_at_a_time:
                try:
                    if not directly:
                        # A stranger is matched before its first message arrives; its name may come later.
                        if watched is not None and (watch.suspected or count_publishers() != watched.count):
                            watch.check()
                        if local.senders:  # handed over before, or of a stranger
                            return
                    if not self._stopped:
                        callback(raw)
                except Exception as error:
                    self._count_error(trouble, error)

        if directly:
            local.receivers.append(receive)
            # The end waits for the message that a sender hands over; the last step is the first.
            self._receivers.callback(one_at_a_time.release)
            self._receivers.callback(one_at_a_time.acquire)
            self._receivers.callback(local.receivers.remove, receive)
        return receive

    def _guarded(self, poll: Poll) -> Poll:
        def guarded() -> bool:
            try:
                return poll()
            except Exception as error:
                self._count_error('work not done', error)
                return False

        return guarded

    def _count_error(self, trouble: str, error: Exception) -> None:
        self.refused += 1
        self.refusal = f'{trouble}: {type(error).__name__}: {error}'
        self.node.get_logger().error(self.refusal, throttle_duration_sec=1.0)
