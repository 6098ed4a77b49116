"""The life of a process: nodes are made, served, and ended with exit code 0 on SIGINT and SIGTERM."""

import contextlib
import gc
import os
import select
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from mount_models.quantity import ParameterError
from mount_ros.data_thread import DataThread
from mount_ros.environment import prepare_environment
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.real_time import WATCH_PERIOD, RealTime
from mount_ros.nodes.scheduling import lock_memory
from mount_ros.nodes.shutdown import end_process, leave_middleware, remove_abandoned_of_the_dead

# What a process gets from its starter. By the environment, so that it holds for nodes of the supervisor and
# of `ros2 launch` alike; without it a node stands for itself.
_STARTER, _PRIORITY = 'ENGINE_MOUNT_STARTER', 'ENGINE_MOUNT_PRIORITY'

_SPIN_PERIOD = 60.0  # s, chosen: longest sleep of an executor, which is woken when it shall end

Create = Callable[[], SafeLifecycleNode]


def run_node(create: Create) -> None:
    """Run one lifecycle node until the process is told to end by SIGINT or SIGTERM, or its starter ends."""
    run_nodes([create])


def run_nodes(creates: Sequence[Create]) -> None:
    """Run several lifecycle nodes in this process: one data thread for all, one thread for each one's rest.

    At the end they are closed in reverse order, so that the sender of setpoints ends before the driver.
    An exception in one of them or in a thread of its data ends all in the same way, with exit code 1.
    """
    real_time = RealTime(int(os.environ.get(_PRIORITY, '0')))
    prepare_environment()
    ending = _Ending()
    nodes = _created(creates)
    data_thread = DataThread(nodes[0].context, nodes[0].report_failure)
    data_thread.shared = len(nodes) > 1
    for node in nodes:
        node.data_thread = data_thread
        node.after_configure = _freeze
        node.after_failure = ending.report_failure
        node.real_time = real_time
    logger = nodes[0].get_logger()
    _freeze()
    # While nothing is active: all threads that want new memory wait for it, 14 ms on a quiet machine.
    real_time.memory_locked = bool(real_time.priority) and lock_memory()
    end_services = [_start_service(node, ending) for node in nodes]
    ending.wait(real_time, logger.warning)
    for node in nodes:
        node.ending.set()
    if ending.starter.ended:
        logger.error(f'{ending.starter.name} has ended, so this one ends too, at 0 A: start the graph again')
    # This order ends with code 0: threads are joined, the nodes leave their work, then the context ends.
    for end_service in end_services:
        end_service()
    for node in reversed(nodes):
        node.close()

    def take_down() -> None:
        for node in reversed(nodes):
            node.destroy_node()
        rclpy.try_shutdown()

    code = 1 if ending.failed else 0
    left = leave_middleware(take_down)
    if ending.starter.ended:
        remove_abandoned_of_the_dead()  # that of the starter; what it started takes its own
    for number in (signal.SIGINT, signal.SIGTERM):  # a second Ctrl-C: Python restores other handlers first
        signal.signal(number, signal.SIG_IGN)
    if not left or code:
        end_process(code)


def environment_of_children(priority: int) -> dict[str, str]:
    """Return what processes need that shall end with this one and run their loops at `priority` (0: none)."""
    return {_STARTER: str(os.getpid()), _PRIORITY: str(priority)}


# Nodes in a process that also does other work.


@contextlib.contextmanager
def ros_context(domain: int) -> Iterator[Context]:
    """Give a context of the middleware in a ROS domain."""
    context = Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield context
    finally:
        rclpy.try_shutdown(context=context)


def transition(step: Callable[[], TransitionCallbackReturn], node: SafeLifecycleNode, name: str) -> None:
    """Take a node through a transition, or raise a `ValueError` with the node's own reason."""
    if step() != TransitionCallbackReturn.SUCCESS:
        raise ValueError(f'{name} refused: {node.sentence}')


def _created(creates: Sequence[Create]) -> list[SafeLifecycleNode]:
    """Return the nodes, or end the process with code 1 and why its arguments do not fit."""
    try:
        # Our own handlers: the context must still be valid while the nodes take the current to 0 A.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # a parameter file that is missing or no YAML
        print(f'[FATAL] {" ".join(str(error).split())}', file=sys.stderr)
        sys.exit(1)
    try:
        return [create() for create in creates]
    except (ParameterError, ParameterException) as error:
        get_logger(Path(sys.argv[0]).name).fatal(str(error))
        rclpy.try_shutdown()
        sys.exit(1)


def _freeze() -> None:
    """Collect garbage now, and never visit again what stands: a full collection takes tens of milliseconds.

    Done when something large has been set up and no answer is due yet.
    """
    gc.collect()
    gc.freeze()


class Starter:
    """The process that started this one: without it a node must not go on driving the coil."""

    def __init__(self) -> None:
        self.descriptors: list[int] = []
        """What can be read once it has ended; none where it is not known, or had ended before."""
        number = os.environ.get(_STARTER, '')
        self._had_ended = False
        self.name = f'the process that started this one ({number})'
        if number:
            try:
                self.descriptors = [os.pidfd_open(int(number))]
            except ProcessLookupError:
                self._had_ended = True

    @property
    def ended(self) -> bool:
        """Whether it has ended; never where none is known."""
        return self._had_ended or bool(select.select(self.descriptors, [], [], 0.0)[0])


class _Ending:
    """Lets the main thread sleep until a signal, a thread or the end of the starter ends the process.

    By a pipe: a lock, as in `threading.Event`, is held for ever by a second signal that comes amid the first.
    It is written to where the signal arrives, before Python knows of it: a handler in Python waits for the
    main thread to go on, which one that falls asleep just then never does.
    """

    def __init__(self) -> None:
        self.failed = False
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        self.starter = Starter()
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)

    def end(self) -> None:
        with contextlib.suppress(BlockingIOError):  # full: it is awake anyway
            os.write(self._write, b'.')

    def report_failure(self) -> None:
        self.failed = True
        self.end()

    def wait(self, real_time: RealTime, warn: Callable[[str], object]) -> None:
        """Look after the priority of the process until it shall end; `warn` takes why it was given back."""
        period = WATCH_PERIOD if real_time.priority else None
        descriptors = [self._read, *self.starter.descriptors]
        while not self.starter.ended and self._read not in select.select(descriptors, [], [], period)[0]:
            if sentence := real_time.check():
                warn(sentence)


def _start_service(node: SafeLifecycleNode, ending: _Ending) -> Callable[[], None]:
    """Serve the rest of a node in a thread: transitions, parameters, questions about its state.

    It sleeps until something arrives: whatever wakes Python there takes the interpreter from the data path.
    Return the function that ends the service once `ending` of the node is set.
    """
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def serve() -> None:
        try:
            while rclpy.ok() and not node.ending.is_set():
                executor.spin_once(_SPIN_PERIOD)
        except Exception as error:
            # The border of the process: without it the nodes would not be closed.
            traceback.print_exc()
            node.report_failure(f'{type(error).__name__}: {error}')
        finally:
            ending.end()

    def end() -> None:
        executor.create_task(lambda: None)  # `wake` alone lets its `spin_once` check and sleep on
        thread.join()
        executor.remove_node(node)
        executor.shutdown()

    thread = threading.Thread(target=serve, name=node.get_name())
    thread.start()
    return end
