"""The life of a process: nodes are made, served, and ended with exit code 0 on SIGINT and SIGTERM."""

import contextlib
import gc
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from mount_models.quantity import ParameterError
from mount_ros.data_thread import DataThread
from mount_ros.environment import prepare_environment
from mount_ros.nodes.aside import SPIN_PERIOD, wake
from mount_ros.nodes.leaving import end_process, leave_middleware
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.real_time import WATCH_PERIOD, RealTime
from mount_ros.nodes.scheduling import drop_real_time, started_in_real_time
from mount_ros.nodes.shared_memory import remove_abandoned_of_the_dead
from mount_ros.nodes.starter import Starter, given_priority

Create = Callable[[], SafeLifecycleNode]


def run_node(create: Create, args: list[str] | None = None) -> None:
    """Run one lifecycle node until the process is told to end by SIGINT or SIGTERM, or its starter ends."""
    run_nodes([create], args)


def run_nodes(creates: Sequence[Create], args: list[str] | None = None) -> None:
    """Run several lifecycle nodes in this process: one data thread for all, one thread for each one's rest.

    At the end they are closed in reverse order, so that the sender of setpoints ends before the driver.
    An exception in one of them or in a thread of its data ends all in the same way, with exit code 1.
    """
    inherited = drop_real_time()
    real_time = RealTime(given_priority() or inherited)
    prepare_environment()
    nodes = _created(creates, args)
    data_thread = DataThread(nodes[0].context, nodes[0].report_failure)
    over = _Ending()
    for node in nodes:
        node.data_thread = data_thread
        node.after_configure = _freeze
        node.after_failure = over.report_failure
        node.real_time = real_time
    logger = nodes[0].get_logger()
    if inherited:
        logger.warning(started_in_real_time(inherited))
    over.listen(signal.SIGINT, signal.SIGTERM, signal.SIGXCPU)
    _freeze()
    real_time.keep_memory()
    services = [_Service(node, over) for node in nodes]
    over.wait(real_time, logger.warning)
    for node in nodes:
        node.ending.set()
    if over.starter.ended:
        logger.error(f'{over.starter.name} has ended, so this one ends too, at 0 A: start the graph again')
    # This order ends with code 0: threads are joined, the nodes leave their work, then the context ends.
    for service in services:
        service.end()
    for node in reversed(nodes):
        node.close()
    real_time.close()  # until here no load keeps the coil from 0 A
    code = 1 if over.failed else 0
    left = leave_middleware(partial(_take_down, nodes), code=code)
    if over.starter.ended:
        remove_abandoned_of_the_dead()  # that of the starter; what it started takes its own
    if not left or code:
        end_process(code)


def _created(creates: Sequence[Create], args: list[str] | None) -> list[SafeLifecycleNode]:
    """Return the nodes, or end the process with code 1 and why its arguments do not fit."""
    try:
        # Our own handlers: the context must still be valid while the nodes take the current to 0 A.
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # a parameter file that is missing or no YAML
        print(f'[FATAL] {" ".join(str(error).split())}', file=sys.stderr)
        sys.exit(1)
    try:
        return [create() for create in creates]
    except ParameterError as error:
        get_logger(Path(sys.argv[0]).name).fatal(str(error))
        rclpy.try_shutdown()
        sys.exit(1)


def _freeze() -> None:
    """Collect garbage now, and never look again at what stands: a full collection takes tens of milliseconds.

    Done when something large has been set up and no answer is due yet.
    """
    gc.collect()
    gc.freeze()


def _take_down(nodes: Sequence[SafeLifecycleNode]) -> None:
    for node in reversed(nodes):
        node.destroy_node()
    rclpy.try_shutdown()


class _Ending:
    """Lets the main thread sleep until a signal, a thread or the end of the starter says that all shall end.

    By a pipe: a lock, as in `threading.Event`, is held for ever by a second signal that comes amid the first.
    It is written to where the signal arrives, before Python knows of it: a handler in Python waits for the
    main thread to go on, which one that falls asleep just then never does.
    """

    def __init__(self) -> None:
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        self.starter = Starter()
        self.failed = False

    def listen(self, *signals: int) -> None:
        """Wake the main thread by these signals too."""
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        for number in signals:
            signal.signal(number, lambda *_: None)

    def tell(self) -> None:
        with contextlib.suppress(BlockingIOError):  # full: it has been told often enough
            os.write(self._write, b'.')

    def report_failure(self) -> None:
        self.failed = True
        self.tell()

    def wait(self, real_time: RealTime, say: Callable[[str], None]) -> None:
        """Look after the priority of the process until it shall end; `say` takes why it was given back."""
        period = WATCH_PERIOD if real_time.priority else None
        while not self.starter.ended:
            told = self._read_for(period)
            if any(number != signal.SIGXCPU for number in told):
                return
            sentence = real_time.ran_without_sleep() if told else real_time.look()
            if sentence:
                say(sentence)

    def _read_for(self, period: float | None) -> bytes:
        """Return the numbers of the signals that came, 46 of what is no signal; nothing after `period` s."""
        if self.starter.wait_beside(self._read, period):
            return os.read(self._read, 4096)
        return b''


class _Service:
    """The thread that serves the rest of a node: transitions, parameters, questions about its state.

    A transition is made in another thread meanwhile. It sleeps until something arrives: whatever wakes Python
    there takes the interpreter from the data path.
    """

    def __init__(self, node: SafeLifecycleNode, over: _Ending):
        self._node = node
        self._over = over
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._serve, name=node.get_name())
        self._thread.start()

    def end(self) -> None:
        self._node.ending.set()
        wake(self._executor)
        self._thread.join()
        self._executor.remove_node(self._node)
        self._executor.shutdown()

    def _serve(self) -> None:
        try:
            while rclpy.ok() and not self._node.ending.is_set():
                self._executor.spin_once(SPIN_PERIOD)
        except Exception as error:
            # The border of the process: without it the nodes would not be closed.
            traceback.print_exc()
            self._node.report_failure(f'{type(error).__name__}: {error}')
        finally:
            self._over.tell()
