"""The 1 kHz path of a node: a plain node of its own on an EventsExecutor in a thread of its own.

While a lifecycle transition runs, the executor of its node serves nothing else. So the data path has
its own node `<name>_io` and goes on receiving during a blocking activation. Nodes that share a process may
share the thread too: a message from one to the other then wakes nobody, and a thread that has other work
between the messages takes them itself, which costs less than to have an executor tell of each.
"""

import contextlib
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from mount_ros.messages.types import message_class
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import Delivery, Topic

_SPIN_PERIOD = 0.2  # s: how often the thread looks whether it shall end
_IDLE_PERIOD = 1e-4  # s, chosen: how long it sleeps when there is neither message nor work,
_LONGEST_IDLE_PERIOD = 2e-3  # s, chosen: and how long when it has been so for a while
_RARE_PERIOD = 0.05  # s, chosen: how often it looks at what nobody waits for
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
        self._inlets = _Inlets()
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
        return self.publisher(topic).handle.publish_raw

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call `callback` with the serialised bytes of each message of `topic`.

        An exception costs the message that it came with, is logged and counted; later ones are served.
        """
        subscription = self.node.create_subscription(
            message_class(topic.type),
            topic.name,
            self._surviving(f'message of {topic.name} not used', callback),
            control_qos(topic, lockstep=self.lockstep),
            raw=True,
        )
        inlets = self._inlets.latched if topic.delivery is Delivery.LATCHED else self._inlets.prompt
        inlets.append(subscription)
        self._tell_thread()

    def unsubscribe(self, topic: Topic) -> None:
        """Hear no more of `topic`, also if it was not subscribed: no message is taken after the return."""
        name = self.node.resolve_topic_name(topic.name)
        for subscription in self._inlets.drop(name):
            self._tell_thread()
            self.node.destroy_subscription(subscription)

    def unmatched(self) -> list[str]:
        """Return the names of the topics that nobody on the other side has been found for yet.

        Data sent before both sides have found each other is lost without a word.
        """
        alone = [s.topic_name for s in self._inlets.all() if s.get_publisher_count() == 0]
        alone += [p.topic_name for p in self._publishers if p.get_subscription_count() == 0]
        return sorted(set(alone))

    def start(self) -> None:
        """Begin to serve the subscriptions."""
        self._serving = True
        self._tell_thread()

    def attend(self, work: Work) -> None:
        """Let the thread that serves the messages do `work` too, whenever it has handled one.

        Who waits for nothing but what happens in this thread needs no thread of its own.
        """
        self._works.append(self._surviving('work not done', work))
        self._thread.attend(self._works[-1])

    def leave_work(self) -> None:
        """Return when none of the attended work is done any more."""
        while self._works:
            self._thread.leave(self._works.pop())

    def rest(self) -> None:
        """From now on only look at what has come a few times a second: nobody waits for an answer."""
        self._set_resting(True)

    def wake(self) -> None:
        """Serve each message at once again."""
        self._set_resting(False)

    def stop(self) -> None:
        """End serving and destroy the node; safe to call twice."""
        if self._stopped:
            return
        self._stopped = True
        self.leave_work()
        if self._serving:
            self._thread.remove(self.node)
        self.node.destroy_node()

    def _set_resting(self, resting: bool) -> None:
        if self._serving and not self._stopped and self._inlets.resting != resting:
            self._inlets.resting = resting
            self._tell_thread()

    def _tell_thread(self) -> None:
        if self._serving:
            self._thread.add(self.node, self._inlets)

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
class _Inlets:
    """The subscriptions of a node: those that somebody waits for, and those to look at now and then."""

    prompt: list[Subscription] = field(default_factory=list)
    latched: list[Subscription] = field(default_factory=list)
    resting: bool = False

    def all(self) -> list[Subscription]:
        return self.prompt + self.latched

    def drop(self, name: str) -> list[Subscription]:
        dropped = [s for s in self.all() if s.topic_name == name]
        self.prompt = [s for s in self.prompt if s not in dropped]
        self.latched = [s for s in self.latched if s not in dropped]
        return dropped


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

    Without work it sleeps in an EventsExecutor. With work it looks after messages by itself too: the last
    node and the last work come first, so that a sample passes through the whole chain in one round where
    those who listen were there before those who speak.

    An exception ends it: `failure` says which, `on_failure` takes the same sentence in this thread, and
    whoever waits or asks for a change gets `DataThreadEndedError`. To leave it is done then.
    """

    def __init__(self, context: Context, on_failure: Callable[[str], None] = lambda sentence: None):
        self.failure = ''
        self._context = context
        self._on_failure = on_failure
        self._executor: Executor | None = None
        self._thread: threading.Thread | None = None
        self._nodes: dict[Node, _Inlets] = {}
        self._works: list[Work] = []
        self._changes: list[_Change] = []
        self._guard = threading.Lock()

    def add(self, node: Node, inlets: _Inlets) -> None:
        """Serve `node` from now on, with what its `inlets` are now."""
        self._change(lambda: self._nodes.update({node: inlets}))

    def remove(self, node: Node) -> None:
        """Return when `node` is served no more and none of its callbacks runs."""
        with contextlib.suppress(DataThreadEndedError):
            self._change(lambda: self._nodes.pop(node))

    def attend(self, work: Work) -> None:
        """Do `work` between the messages from now on, again and again."""
        self._change(lambda: self._works.append(work))

    def leave(self, work: Work) -> None:
        """Return when `work` is done no more and does not run."""
        with contextlib.suppress(DataThreadEndedError):
            self._change(lambda: self._works.remove(work))

    def _change(self, make: Callable[[], Any]) -> None:
        """Return when the change is made, or raise what prevents it; never waits for ever."""
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
            # The last first: who listens was there before who speaks.
            inlets = list(self._nodes.values())[::-1]
            if self._works:
                self._work_and_take(inlets)
            else:
                self._wait_for_events(executor, inlets)

    def _apply_changes(self, executor: Executor) -> bool:
        """Return whether there is anything left to serve or to do."""
        with self._guard:
            for change in self._changes:
                change.attempt()
            waking = {node for node, inlets in self._nodes.items() if not inlets.resting}
            wanted = set() if self._works else waking
            served = set(executor.get_nodes())
            for node in served - wanted:
                executor.remove_node(node)
            for node in wanted - served:
                executor.add_node(node)
            if served - wanted:
                _take_effect(executor)
            serving = bool(self._nodes) or bool(self._works)
            if not serving:
                self._executor = None
            changes, self._changes = self._changes, []
            for change in changes:
                change.done.set()
            return serving

    def _wait_for_events(self, executor: Executor, nodes: Sequence[_Inlets]) -> None:
        look = _RareLook([s for inlets in nodes if inlets.resting for s in inlets.all()])
        period = _RARE_PERIOD if look.needed else _SPIN_PERIOD
        # spin() of this executor dispatches nothing in the pinned wheels; spin_once does, one event.
        while not self._changes:
            executor.spin_once(period)
            look()

    def _work_and_take(self, nodes: Sequence[_Inlets]) -> None:
        works = self._works[::-1]
        prompt, rare = [], []
        for inlets in nodes:
            prompt += [] if inlets.resting else inlets.prompt
            rare += inlets.all() if inlets.resting else inlets.latched
        # Looked up once: to ask each subscription for its parts costs as much as to take a message.
        takes = [(s.handle.take_message, s.msg_type, s.callback) for s in prompt]
        look = _RareLook(rare)
        pause = _IDLE_PERIOD
        while not self._changes:
            busy = False
            for work in works:
                busy |= work()
            for take, kind, callback in takes:
                taken = take(kind, True)
                if taken is not None:
                    callback(taken[0])
                    busy = True
            look()
            if busy:
                pause = _IDLE_PERIOD
            else:
                time.sleep(pause)
                pause = min(2.0 * pause, _LONGEST_IDLE_PERIOD)


def _take_effect(executor: Executor) -> None:
    """Return when the executor has let go of removed nodes, which it does by an event of its own.

    Until then it holds their subscriptions, and notes each message that comes for ever.
    """
    reached: list[bool] = []
    executor.create_task(reached.append, True)
    while not reached:
        executor.spin_once(_SPIN_PERIOD)


class _RareLook:
    """Hands over what has come on some subscriptions, when it is called after `_RARE_PERIOD` again."""

    def __init__(self, subscriptions: Sequence[Subscription]):
        self.needed = bool(subscriptions)
        self._subscriptions = subscriptions
        self._next = 0.0

    def __call__(self) -> None:
        if time.monotonic() < self._next:
            return
        for subscription in self._subscriptions:
            take, kind = subscription.handle.take_message, subscription.msg_type
            while (taken := take(kind, True)) is not None:
                subscription.callback(taken[0])
        self._next = time.monotonic() + _RARE_PERIOD
