"""The thread that serves the data paths of a process; nodes that share a process may share it."""

import contextlib
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node

from mount_ros.direct import DirectDelivery
from mount_ros.private_rclpy import raw_taker

_SPIN_PERIOD = 0.2  # s: how often the thread looks whether it shall end
_IDLE_PERIOD = 1e-3  # s, chosen: how long it sleeps in lock-step when there is neither message nor work
_PATIENCE = 10.0  # s, chosen: for a change in what the thread serves; it takes less than a millisecond

Work = Callable[[], bool]
"""Does what there is to do without waiting; returns whether there was anything."""


class DataThreadError(RuntimeError):
    """The data thread does not do what it is asked to; the text says why."""


class DataThreadEndedError(DataThreadError):
    """The data thread has ended by an exception; it serves nothing any more."""


@dataclass
class _Change:
    """A change in what a thread serves, and its outcome for the caller that waits for it."""

    make: Callable[[], Any]
    done: threading.Event = field(default_factory=threading.Event)
    error: Exception | None = None

    def attempt(self) -> None:
        """Make the change; what it raises concerns the caller, not the thread."""
        try:
            self.make()
        except Exception as error:
            self.error = error


class DataThread:
    """A thread that serves nodes and does attended work; it lives as long as there is one or the other.

    Without work, so always in real time, it sleeps in an EventsExecutor. With work (lock-step in one process)
    it polls the subscriptions itself. Processor time of 65 000 samples, medians of three runs, busy machine:
    18 s; with `EventsExecutor.spin_once` between the works 19 s, with an EventsExecutor and a thread for each
    work 22 s. The last node and the last work come first, so that a sample passes through the whole chain in
    one round where receivers were added before senders.

    An exception ends it: `failure` says which, `on_failure` takes the same sentence in this thread, and
    every waiting or later call of `change` raises `DataThreadEndedError`; `remove` and `remove_poll` return.
    """

    def __init__(self, context: Context, on_failure: Callable[[str], None] = lambda sentence: None):
        self.failure = ''
        self.direct = DirectDelivery()
        """Of the nodes that share this thread."""
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

    def add_poll(self, work: Work) -> None:
        """Do `work` between the messages from now on, again and again."""
        self.change(lambda: self._works.append(work))

    def remove_poll(self, work: Work) -> None:
        """Return when `work` is done no more and does not run, also if it was left before."""
        with contextlib.suppress(DataThreadEndedError):
            self.change(lambda: self._forget(work))

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

    def _forget(self, work: Work) -> None:
        if work in self._works:
            self._works.remove(work)

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
            # The border of the thread: unreported, its end would leave the callers waiting.
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
