"""Takes everything that arrives on many topics, in batches, for those who need all of it but not at once.

The middleware queues messages by itself; waking an executor for each of them costs several times what
taking it does. A batch every few milliseconds loses nothing, and brings what a callback does not: when the
message was sent and when it arrived.
"""

import operator
import threading
import traceback
from collections.abc import Callable

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from mount_ros.data_path import io_node
from mount_ros.messages.cdr import message_class
from mount_ros.private_rclpy import Taken, raw_taker
from mount_ros.qos import publisher_qos
from mount_ros.topics import Topic

Receive = Callable[[bytes, int, int], None]
"""Takes (serialised message, time of arrival ns, time of sending ns), both of the system clock."""

_PERIOD = 0.004  # s, chosen: four samples a batch; the queues hold five seconds


class Collector:
    """Raw subscriptions of a node, emptied by one thread from `start` to `stop`, oldest arrival first.

    It takes a batch each `period` s. `on_failure` receives the sentence on the exception that has ended it.
    """

    def __init__(
        self,
        owner: Node,
        *,
        period: float = _PERIOD,
        on_failure: Callable[[str], None] = lambda sentence: None,
    ):
        self.node = io_node(owner)
        self.refused = 0
        """Messages whose receiver raised an exception; `refusal` says what the last one was."""
        self.refusal = ''
        self.failure = ''
        """Why the thread has ended by itself; empty while it serves."""
        self._period = period
        self._on_failure = on_failure
        self._receivers: list[tuple[Subscription, Callable[[], Taken | None], Receive]] = []
        self._thread = threading.Thread(target=self._serve, name=self.node.get_name(), daemon=True)
        self._ending = threading.Event()

    @property
    def name(self) -> str:
        """The full name of the node that has the topics."""
        return self.node.get_fully_qualified_name()

    def collect(self, topic: Topic, receive: Receive, qos: QoSProfile | None = None) -> Subscription:
        """Hand every message of `topic` to `receive`; with another `qos`, those that it brings."""
        subscription = self.node.create_subscription(
            message_class(topic.type), topic.name, _never_called, qos or publisher_qos(topic), raw=True
        )
        self._receivers.append((subscription, raw_taker(subscription), receive))
        return subscription

    def sender(self, topic: Topic) -> Callable[[bytes], None]:
        """Create a publisher of `topic` and return the function that publishes its bytes, from any thread."""
        return self.node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic)).publish

    def unmatched(self) -> list[str]:
        """Return the names of the topics that no publisher has been found for yet."""
        return sorted(s.topic_name for s, *_ in self._receivers if s.get_publisher_count() == 0)

    def start(self) -> None:
        """Begin to take messages."""
        self._thread.start()

    def stop(self) -> None:
        """Take what is there, end the thread and destroy the node; safe to call twice."""
        if self._ending.is_set():
            return
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()
        self.node.destroy_node()

    def _serve(self) -> None:
        try:
            while not self._ending.wait(self._period):
                self._take_batch()
            self._take_batch()
        except BaseException as error:
            # The border of the thread: unreported, its end would leave a recording without its messages.
            traceback.print_exc()
            self.failure = f'the thread that takes the messages has ended: {type(error).__name__}: {error}'
            self._on_failure(self.failure)

    def _take_batch(self) -> None:
        batch: list[tuple[int, int, bytes, Receive]] = []
        for _, take, receive in self._receivers:
            while (taken := take()) is not None:
                raw, times = taken
                batch.append((times['received_timestamp'], times['source_timestamp'], raw, receive))
        batch.sort(key=operator.itemgetter(0))
        for received, sent, raw, receive in batch:
            try:
                receive(raw, received, sent)
            except Exception as error:
                # The border of the thread: what one message does must not cost all others.
                self.refused += 1
                self.refusal = f'a message was not taken: {type(error).__name__}: {error}'
                self.node.get_logger().error(self.refusal, throttle_duration_sec=1.0)


def _never_called(_: bytes) -> None:
    """No executor serves these subscriptions."""
