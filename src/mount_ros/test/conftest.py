"""What the tests share: threads that serve nodes."""

import threading
from collections.abc import Callable, Iterator

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


@pytest.fixture
def serve(context) -> Iterator[Callable[[Node], None]]:
    """Return a function that serves a node in a thread until the end of the test, which destroys it."""
    ending = threading.Event()
    threads: list[threading.Thread] = []

    def spin(node: Node) -> None:
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        while not ending.is_set():
            executor.spin_once(0.05)
        executor.remove_node(node)
        executor.shutdown()
        node.destroy_node()

    def start(node: Node) -> None:
        threads.append(threading.Thread(target=spin, args=(node,)))
        threads[-1].start()

    yield start
    ending.set()
    for thread in threads:
        thread.join()
