"""The 1 kHz path of a node: a plain node of its own on an EventsExecutor in a thread of its own.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation. Nodes that share a process may
share the thread too.
"""

import contextlib
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher

from mount_ros.messages.types import message_class
from mount_ros.private_rclpy import raw_taker
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import Delivery, Topic

_SPIN_PERIOD = 0.2  # s: how often the thread looks whether it shall end
_IDLE_PERIOD = 1e-3  # s, chosen: how long it sleeps in lock-step when there is neither message nor work
_PATIENCE = 10.0  # s, chosen: for a change in what the thread serves; it takes less than a millisecond

Work = Callable[[], bool]
"""Does what there is to do without waiting; returns whether there was anything."""


class DataThreadError(RuntimeError):
    """The data thread does not do what it is asked to; the text says why."""


class DataThreadEndedError(DataThreadError):
    """The data thread has ended by an exception; it serves nothing any more."""


def io_node(owner: Node) -> Node:
    """Return the plain node `<name>_io` that carries the data of the node `owner`."""
    return Node(
        f'{owner.get_name()}_io',
        namespace=owner.get_namespace(),
        context=owner.context,
        use_global_arguments=False,
        start_parameter_services=False,
        enable_rosout=False,
    )


class DataPath:
    """Publishers and raw subscriptions of a node, served from `start` to `stop`."""

    def __init__(self, owner: Node, *, lockstep: bool = False, thread: 'DataThread | None' = None):
        self.lockstep = lockstep
        self._thread = thread or DataThread(owner.context)
        self.node = io_node(owner)
        self._serving = False
        self._publishers: list[Publisher] = []
        self._works: list[Work] = []
        self._stopped = False
        self.refused = 0
        """Messages and pieces of work that ended with an exception; `refusal` says what the last one was."""
        self.refusal = ''

    @property
    def failure(self) -> str:
        """Why the thread that serves this path has ended by itself; empty while it serves."""
        return self._thread.failure

    def publisher(self, topic: Topic) -> Publisher:
        """Create a publisher of `topic`."""
        publisher = self.node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic))
        if topic.delivery is not Delivery.MARK:  # a mark that nobody hears is no loss
            self._publishers.append(publisher)
        return publisher

    def sender(self, topic: Topic) -> Callable[[bytes], None]:
        """Create a publisher of `topic` and return the function that publishes its bytes, no more."""
        return self.publisher(topic).publish

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`.

        An exception costs the message that it came with, is logged and counted; later ones are served.
        """
        kind, qos = message_class(topic.type), control_qos(topic, lockstep=self.lockstep)
        guarded = self._surviving(f'message of {topic.name} not used', callback)
        self._change(lambda: self.node.create_subscription(kind, topic.name, guarded, qos, raw=True))

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscriptions of `topic`, if there are any: no message is taken after the return."""
        name = self.node.resolve_topic_name(topic.name)
        for subscription in [s for s in self.node.subscriptions if s.topic_name == name]:
            self._change(partial(self.node.destroy_subscription, subscription))

    def unmatched(self) -> list[str]:
        """Return the names of the topics that nobody on the other side has been found for yet.

        Data sent before both sides have found each other is lost without a word.
        """
        alone = [s.topic_name for s in self.node.subscriptions if s.get_publisher_count() == 0]
        alone += [p.topic_name for p in self._publishers if p.get_subscription_count() == 0]
        return sorted(set(alone))

    def start(self) -> None:
        """Begin to serve the subscriptions."""
        self._serving = True
        self._thread.add(self.node)

    def attend(self, work: Work) -> None:
        """Let the thread that serves the messages do `work` too, between them, again and again.

        For lock-step in one process: work that only continues what happens in this thread.
        """
        self._works.append(self._surviving('work not done', work))
        self._thread.attend(self._works[-1])

    def leave_work(self) -> None:
        """Return when none of the attended work is done any more."""
        while self._works:
            self._thread.leave(self._works.pop())

    def stop(self) -> None:
        """End serving and destroy the node; safe to call twice."""
        if self._stopped:
            return
        self._stopped = True
        self.leave_work()
        if self._serving:
            self._thread.remove(self.node)
        self.node.destroy_node()

    def _change(self, make: Callable[[], Any]) -> None:
        """Change what the thread may be serving."""
        if self._serving:
            self._thread.change(make)
        else:
            make()

    def _surviving(self, trouble: str, callback: Callable[..., Any]) -> Callable[..., Any]:
        # The border of the data thread: an exception would end it, and with it every node that it serves.
        logger = self.node.get_logger()

        def guarded(*arguments: bytes) -> Any:
            try:
                return callback(*arguments)
            except Exception as error:
                self.refused += 1
                self.refusal = f'{trouble}: {type(error).__name__}: {error}'
                logger.error(self.refusal, throttle_duration_sec=1.0)
                return False

        return guarded


@dataclass
class _Change:
    """A change in what a thread serves, and what came of it for the one who waits for it."""

    make: Callable[[], Any]
    done: threading.Event = field(default_factory=threading.Event)
    error: Exception | None = None

    def attempt(self) -> None:
        """Make the change; what it raises is a matter of the one who asked, not of the thread."""
        try:
            self.make()
        except Exception as error:
            self.error = error


class DataThread:
    """A thread that serves nodes and does attended work; it lives as long as there is one or the other.

    Without work, so always in real time, it sleeps in an EventsExecutor. With work (lock-step in one process)
    it polls the subscriptions itself: FIGURE.
    The last node and the last work come first, so that a sample passes through the whole chain in
    one round where receivers were added before senders.

    An exception ends it: `failure` says which, `on_failure` takes the same sentence in this thread, and
    whoever waits or asks for a change gets `DataThreadEndedError`. To leave it is done then.
    """

    def __init__(self, context: Context, on_failure: Callable[[str], None] = lambda sentence: None):
        self.failure = ''
        self._context = context
        self._on_failure = on_failure
        self._executor: Executor | None = None
        self._thread: threading.Thread | None = None
        self._nodes: list[Node] = []
        self._works: list[Work] = []
        self._changes: list[_Change] = []
        self._guard = threading.Lock()

    def add(self, node: Node) -> None:
        """Serve the subscriptions of `node` from now on."""
        self.change(lambda: self._nodes.append(node))

    def remove(self, node: Node) -> None:
        """Return when `node` is served no more and none of its callbacks runs."""
        with contextlib.suppress(DataThreadEndedError):
            self.change(lambda: self._nodes.remove(node))

    def attend(self, work: Work) -> None:
        """Do `work` between the messages from now on, again and again."""
        self.change(lambda: self._works.append(work))

    def leave(self, work: Work) -> None:
        """Return when `work` is done no more and does not run."""
        with contextlib.suppress(DataThreadEndedError):
            self.change(lambda: self._works.remove(work))

    def change(self, make: Callable[[], Any]) -> None:
        """Return when `make` was called between two messages, or raise what prevents it: 10 s at most."""
        if threading.current_thread() is self._thread:
            raise DataThreadError('a callback of the data thread cannot wait for the data thread')
        change = _Change(make)
        with self._guard:
            if not self.failure:
                self._changes.append(change)
                self._wake()
            thread = self._thread
        if not self.failure and not change.done.wait(_PATIENCE):
            raise DataThreadError(
                f'the data thread has not answered for {_PATIENCE:g} s: one of its callbacks does not return'
            )
        if self._executor is None and thread is not None:
            thread.join()  # an executor that outlives its context ends the process with an abort
        if self.failure and not change.done.is_set():
            raise DataThreadEndedError(self.failure)
        if change.error is not None:
            raise change.error

    def _wake(self) -> None:
        """Let the thread look at the changes; begin it where there is none."""
        if self._executor is None:
            self._executor = EventsExecutor(context=self._context)
            arguments = (self._executor,)
            self._thread = threading.Thread(target=self._run, args=arguments, name='data', daemon=True)
            self._thread.start()
        self._executor.wake()

    def _run(self, executor: Executor) -> None:
        try:
            self._serve(executor)
        except BaseException as error:
            # The border of the thread: unheard, its end would leave the callers waiting for ever.
            traceback.print_exc()
            self._fail(f'the data thread has ended: {type(error).__name__}: {error}')

    def _fail(self, sentence: str) -> None:
        with self._guard:
            self.failure = sentence
            self._executor = None
            waiting, self._changes = self._changes, []
        for change in waiting:
            change.error = DataThreadEndedError(sentence)
            change.done.set()
        self._on_failure(sentence)

    def _serve(self, executor: Executor) -> None:
        while self._apply_changes(executor):
            if self._works:
                self._work_and_take()
            else:
                # spin() of this executor dispatches nothing in the pinned wheels; spin_once does, one event.
                while not self._changes:
                    executor.spin_once(_SPIN_PERIOD)

    def _apply_changes(self, executor: Executor) -> bool:
        """Return whether there is anything left to serve or to do."""
        changes = self._changes.copy()
        for change in changes:
            change.attempt()
        served, wanted = set(executor.get_nodes()), set() if self._works else set(self._nodes)
        for node in served - wanted:
            executor.remove_node(node)
        for node in wanted - served:
            executor.add_node(node)
        _take_effect(executor)
        with self._guard:
            del self._changes[: len(changes)]
            serving = bool(self._nodes or self._works or self._changes)
            if not serving:
                self._executor = None
        for change in changes:
            change.done.set()
        return serving

    def _work_and_take(self) -> None:
        works = self._works[::-1]
        subscriptions = [s for node in self._nodes[::-1] for s in node.subscriptions]
        # Looked up once: to ask each subscription for its parts costs as much as to take a message.
        takes = [(raw_taker(s), s.callback) for s in subscriptions]
        while not self._changes:
            busy = False
            for work in works:
                busy |= work()
            for take, callback in takes:
                taken = take()
                if taken is not None:
                    callback(taken[0])
                    busy = True
            if not busy:
                time.sleep(_IDLE_PERIOD)


def _take_effect(executor: Executor) -> None:
    """Return when the executor has let go of what was removed, which it does by an event of its own.

    Until then it holds those subscriptions, and notes each message that comes for ever.
    """
    reached: list[bool] = []
    executor.create_task(reached.append, True)
    while not reached:
        executor.spin_once(_SPIN_PERIOD)
