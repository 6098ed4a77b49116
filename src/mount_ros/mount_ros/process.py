"""The life of a node's process: start, spin, end with exit code 0 on SIGINT and SIGTERM."""

import gc
import signal
from collections.abc import Callable

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from mount_ros.environment import prepare_environment
from mount_ros.lifecycle import SafeLifecycleNode

_SPIN_PERIOD = 0.1  # s: how soon a signal is noticed


def run_node(create: Callable[[], SafeLifecycleNode], args: list[str] | None = None) -> None:
    """Run one lifecycle node until the process is told to end by SIGINT or SIGTERM."""
    prepare_environment()
    # Our own handlers: the context must still be valid while the node takes the current to 0 A.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = create()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.ending.set())
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    gc.freeze()  # what stands after set-up need not be looked at again
    while rclpy.ok() and not node.ending.is_set():
        executor.spin_once(_SPIN_PERIOD)
    # This order ends with code 0: the node leaves its work, threads are joined, then the context ends.
    node.close()
    executor.remove_node(node)
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
