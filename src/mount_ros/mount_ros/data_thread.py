"""The thread that serves the data paths of a process; nodes that share a process may share it."""

import contextlib
import threading
import time
import traceback
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher

from mount_ros.private_rclpy import raw_taker

_SPIN_PERIOD = 0.2  # s: how often the thread checks whether it shall end
_IDLE_PERIOD = 1e-3  # s, chosen: its sleep in lock-step when there is neither message nor work
_CHANGE_TIMEOUT = 10.0  # s, chosen: a change in what the thread serves takes less than a millisecond

Poll = Callable[[], bool]
"""Does the work that is there without waiting; returns whether there was any."""


class DataThreadError(RuntimeError):
    """The data thread cannot make a change; the text says why."""


class DataThreadEndedError(DataThreadError):
    """The data thread has ended by an exception; it serves nothing any more."""


@dataclass
class LocalTopic:
    """The ends of one topic among the nodes that share a data thread."""

    senders: list[Publisher] = field(default_factory=list)
    receivers: list[Callable[[bytes, bool], None]] = field(default_factory=list)


class DataThread:
    """A thread that serves nodes and polls; it lives as long as there is one or the other.

    Without polls, so always in real time, it sleeps in an EventsExecutor. With polls (lock-step in one
    process) it takes the messages itself. Processor time of 65 000 samples, medians of three runs, busy
    machine: 18 s; with `EventsExecutor.spin_once` between the polls 19 s, with an EventsExecutor and a thread
    for each poll 22 s. The last node and the last poll come first, so that a sample passes through the whole
    chain in one round where receivers were added before senders.

    An exception ends it: `failure` says which, `on_failure` takes the same sentence in this thread, and
    each waiting or later `change` raises `DataThreadEndedError`; `remove` and `remove_poll` return.
    """

    def __init__(self, context: Context, on_failure: Callable[[str], None] = lambda sentence: None):
        self.failure = ''
        self.shared = True
        """Whether more than one node may be served."""
        self.local_topics: dict[str, LocalTopic] = defaultdict(LocalTopic)
        """By full name: messages pass directly between the nodes that share this thread."""
        self._context = context
        self._on_failure = on_failure
        self._executor: Executor | None = None
        self._thread: threading.Thread | None = None
        self._nodes: list[Node] = []
        self._polls: list[Poll] = []
        self._changes: list[tuple[Callable[[], object], Future[None]]] = []
        self._guard = threading.Lock()

    def add(self, node: Node) -> None:
        """Serve the subscriptions of `node` from now on."""
        self.change(lambda: self._nodes.append(node))

    def remove(self, node: Node) -> None:
        """Return when `node` is served no more and none of its callbacks runs."""
        with contextlib.suppress(DataThreadEndedError):
            self.change(lambda: self._nodes.remove(node))

    def add_poll(self, poll: Poll) -> None:
        """Call `poll` between the messages from now on, again and again."""
        self.change(lambda: self._polls.append(poll))

    def remove_poll(self, poll: Poll) -> None:
        """Return when `poll` is called no more and does not run; nothing is done where it is unknown."""
        with contextlib.suppress(DataThreadEndedError):
            self.change(lambda: self._polls.remove(poll) if poll in self._polls else None)

    def change(self, make: Callable[[], object]) -> None:
        """Return when `make` was called between two messages, or raise what prevents it: 10 s at most."""
        if threading.current_thread() is self._thread:
            raise DataThreadError('a callback of the data thread cannot wait for the data thread')
        made = Future[None]()
        with self._guard:
            if self.failure:
                raise DataThreadEndedError(self.failure)
            self._changes.append((make, made))
            self._wake()
            thread = self._thread
        try:
            made.result(_CHANGE_TIMEOUT)
        except TimeoutError:
            raise DataThreadError(
                f'the data thread did not respond for {_CHANGE_TIMEOUT:g} s: one of its callbacks hangs'
            ) from None
        finally:
            if self._executor is None and thread is not None:
                thread.join()  # an executor that outlives its context ends the process with an abort

    def _wake(self) -> None:
        """Let the thread see the changes; start it where there is none."""
        if self._executor is None:
            self._executor = EventsExecutor(context=self._context)
            arguments = (self._executor,)
            self._thread = threading.Thread(target=self._run, args=arguments, name='data', daemon=True)
            self._thread.start()
        self._executor.wake()

    def _run(self, executor: Executor) -> None:
        try:
            while self._apply_changes(executor):
                if self._polls:
                    self._poll_and_take()
                else:
                    # spin() of this executor dispatches nothing in the pinned wheels; spin_once one event.
                    while not self._changes:
                        executor.spin_once(_SPIN_PERIOD)
        except BaseException as error:
            # The border of the thread: unreported, its end would leave the callers waiting.
            traceback.print_exc()
            sentence = f'the data thread has ended: {type(error).__name__}: {error}'
            with self._guard:
                self.failure, self._executor = sentence, None
                waiting, self._changes = self._changes, []
            for _, made in waiting:
                made.set_exception(DataThreadEndedError(sentence))
            self._on_failure(sentence)

    def _apply_changes(self, executor: Executor) -> bool:
        """Return whether anything is left to serve or to poll."""
        changes, settled = self._changes.copy(), []
        for make, made in changes:
            try:
                make()
                settled.append(partial(made.set_result, None))
            except Exception as error:  # it concerns the caller of `change`, not the thread
                settled.append(partial(made.set_exception, error))
        served, wanted = set(executor.get_nodes()), set() if self._polls else set(self._nodes)
        for node in served - wanted:
            executor.remove_node(node)
        for node in wanted - served:
            executor.add_node(node)
        _drain(executor)
        with self._guard:
            del self._changes[: len(changes)]
            serving = bool(self._nodes or self._polls or self._changes)
            if not serving:
                self._executor = None
        for settle in settled:
            settle()
        return serving

    def _poll_and_take(self) -> None:
        polls = self._polls[::-1]
        # Looked up once: the parts of a subscription cost as much as a message.
        takes = [(raw_taker(s), s.callback) for node in self._nodes[::-1] for s in node.subscriptions]
        while not self._changes:
            busy = False
            for poll in polls:
                busy |= poll()
            for take, callback in takes:
                taken = take()
                if taken is not None:
                    callback(taken[0])
                    busy = True
            if not busy:
                time.sleep(_IDLE_PERIOD)


def _drain(executor: Executor) -> None:
    """Return when the executor has let go of removed nodes, which it does by an event of its own.

    Until then it holds their subscriptions, and notes each message for ever.
    """
    reached: list[bool] = []
    executor.create_task(reached.append, True)
    while not reached:
        executor.spin_once(_SPIN_PERIOD)
