"""The 1 kHz path of a node: a plain node of its own on an EventsExecutor in a thread of its own.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation. Nodes that share a process may
share the thread too: a message from one to the other then wakes nobody.
"""

import threading
from collections.abc import Callable

from rclpy.context import Context
from rclpy.executors import Executor
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
    """Publishers and raw subscriptions of a node, served from `start` to `stop`."""

    def __init__(self, owner: Node, *, lockstep: bool = False, thread: 'DataThread | None' = None):
        self.lockstep = lockstep
        self._thread = thread or DataThread(owner.context)
        self.node = Node(
            f'{owner.get_name()}_io',
            namespace=owner.get_namespace(),
            context=owner.context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._serving = False
        self._publishers: list[Publisher] = []
        self._subscriptions: list[Subscription] = []
        self._resting: _RareLook | None = None
        self._stopped = False

    def publisher(self, topic: Topic) -> Publisher:
        """Create a publisher of `topic`."""
        publisher = self.node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic))
        self._publishers.append(publisher)
        return publisher

    def sender(self, topic: Topic) -> Callable[[bytes], None]:
        """Create a publisher of `topic` and return the function that publishes its bytes, no more."""
        return self.publisher(topic).handle.publish_raw

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`.

        An exception costs the message that it came with, and is logged; later ones are served.
        """
        subscription = self.node.create_subscription(
            message_class(topic.type),
            topic.name,
            self._surviving(topic, callback),
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
        self._thread.add(self.node)
        self._serving = True

    def rest(self) -> None:
        """From now on only look at what came last, a few times a second: nobody waits for an answer."""
        if self._resting is None and self._serving:
            self._thread.remove(self.node)
            self._resting = _RareLook(self._subscriptions)

    def wake(self) -> None:
        """Serve each message at once again."""
        if self._resting is not None:
            self._resting.end()
            self._resting = None
            self._thread.add(self.node)

    def stop(self) -> None:
        """End serving and destroy the node; safe to call twice."""
        if self._stopped:
            return
        self._stopped = True
        if self._resting is not None:
            self._resting.end()
        elif self._serving:
            self._thread.remove(self.node)
        self.node.destroy_node()

    def _surviving(self, topic: Topic, callback: Callable[[bytes], None]) -> Callable[[bytes], None]:
        # The border of the data thread: an exception would end it, and with it every node that it serves.
        logger = self.node.get_logger()

        def guarded(raw: bytes) -> None:
            try:
                callback(raw)
            except Exception as error:
                text = f'message of {topic.name} not used: {type(error).__name__}: {error}'
                logger.error(text, throttle_duration_sec=1.0)

        return guarded


class DataThread:
    """A thread with an EventsExecutor; it lives as long as it has nodes to serve."""

    def __init__(self, context: Context):
        self._context = context
        self._executor: Executor | None = None
        self._thread: threading.Thread | None = None
        self._changes: list[tuple[Node, bool, threading.Event]] = []
        self._guard = threading.Lock()

    def add(self, node: Node) -> None:
        """Serve `node` from now on."""
        self._change(node, wanted=True)

    def remove(self, node: Node) -> None:
        """Return when `node` is served no more and none of its callbacks runs."""
        self._change(node, wanted=False)

    def _change(self, node: Node, *, wanted: bool) -> None:
        done = threading.Event()
        with self._guard:
            self._changes.append((node, wanted, done))
            if self._executor is None:
                self._executor = EventsExecutor(context=self._context)
                arguments = (self._executor,)
                self._thread = threading.Thread(target=self._serve, args=arguments, name='data', daemon=True)
                self._thread.start()
            self._executor.wake()
            thread = self._thread
        done.wait()
        if self._executor is None and thread is not None:
            thread.join()  # an executor that outlives its context ends the process with an abort

    def _serve(self, executor: Executor) -> None:
        # spin() of this executor dispatches nothing in the pinned wheels; spin_once does, one event a call.
        spin_once = executor.spin_once
        while self._apply_changes(executor):
            while not self._changes:
                spin_once(_SPIN_PERIOD)

    def _apply_changes(self, executor: Executor) -> bool:
        """Add and remove nodes; return whether there is anything left to serve."""
        with self._guard:
            changes, self._changes = self._changes, []
            for node, wanted, _ in changes:
                (executor.add_node if wanted else executor.remove_node)(node)
            serving = bool(executor.get_nodes())
            if not serving:
                self._executor = None
            for _, _, done in changes:
                done.set()
            return serving


class _RareLook:
    """Takes what has come on some subscriptions a few times a second, in a thread of its own."""

    def __init__(self, subscriptions: list[Subscription]):
        self._subscriptions = subscriptions
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._look, name='rare_look', daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Return when nothing is taken any more."""
        self._ending.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._ending.wait(_REST_PERIOD):
            for subscription in self._subscriptions:
                handle, kind = subscription.handle, subscription.msg_type
                with handle:
                    while (taken := handle.take_message(kind, True)) is not None:
                        subscription.callback(taken[0])
