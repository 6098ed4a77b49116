"""The life of a process: nodes are made, served, and ended with exit code 0 on SIGINT and SIGTERM."""

import gc
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from mount_ros.data_path import DataThread
from mount_ros.environment import prepare_environment
from mount_ros.lifecycle import SafeLifecycleNode

_SPIN_PERIOD = 0.1  # s: how soon a signal is noticed

Create = Callable[[], SafeLifecycleNode]


def run_node(create: Create, args: list[str] | None = None) -> None:
    """Run one lifecycle node until the process is told to end by SIGINT or SIGTERM."""
    run_nodes([create], args)


def run_nodes(creates: Sequence[Create], args: list[str] | None = None) -> None:
    """Run several lifecycle nodes in this process: one data thread for all, one thread for each one's rest.

    At the end they are closed in reverse order, so that who sends setpoints ends before who carries them.
    An exception in one of them ends all in the same way, with exit code 1.
    """
    prepare_environment()
    # Our own handlers: the context must still be valid while the nodes take the current to 0 A.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    nodes = [create() for create in creates]
    data_thread = DataThread(nodes[0].context)
    for node in nodes:
        node.data_thread = data_thread
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: [node.ending.set() for node in nodes])
    gc.freeze()  # what stands after set-up need not be looked at again
    failed: list[SafeLifecycleNode] = []

    def serve(node: SafeLifecycleNode) -> None:
        try:
            _serve(node)
        except Exception as error:
            # The border of the process: nobody would close the nodes, and the others would live on alone.
            traceback.print_exc()
            node.get_logger().fatal(f'{type(error).__name__}: {error}')
            failed.append(node)
            for each in nodes:
                each.ending.set()

    threads = [threading.Thread(target=serve, args=(node,), name=node.get_name()) for node in nodes[1:]]
    for thread in threads:
        thread.start()
    serve(nodes[0])
    # This order ends with code 0: threads are joined, the nodes leave their work, then the context ends.
    for thread in threads:
        thread.join()
    for node in reversed(nodes):
        node.close()
        node.destroy_node()
    rclpy.try_shutdown()
    if failed:
        sys.exit(1)


def _serve(node: SafeLifecycleNode) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok() and not node.ending.is_set():
            executor.spin_once(_SPIN_PERIOD)
    finally:
        executor.remove_node(node)
        executor.shutdown()
