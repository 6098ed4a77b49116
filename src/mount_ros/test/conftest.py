"""A ROS domain and context for each test, and the one way to wait."""

import gc
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from mount_ros.environment import prepare_environment
from mount_ros.testing import free_domain

LIMIT = 30.0  # s: only a failure takes so long


@pytest.fixture
def domain() -> Iterator[int]:
    with free_domain() as number:
        yield number


@pytest.fixture
def context(domain) -> Iterator[rclpy.Context]:
    prepare_environment()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    yield context
    gc.collect()  # until then rclpy keeps the services of a lifecycle node in the graph
    rclpy.try_shutdown(context=context)


@pytest.fixture
def wait_until() -> Callable[..., None]:
    """Return a function that waits for a condition, or fails saying what did not happen."""

    def wait(condition: Callable[[], Any], what: str) -> None:
        end = time.monotonic() + LIMIT
        while not condition():
            assert time.monotonic() < end, f'{what} did not happen within {LIMIT:g} s'
            time.sleep(0.002)

    return wait


@pytest.fixture
def serve(context) -> Iterator[Callable[[Node], None]]:
    """Return a function that serves a node in a thread until the end of the test."""
    ending = threading.Event()
    threads: list[threading.Thread] = []

    def spin(node: Node) -> None:
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        while not ending.is_set():
            executor.spin_once(0.05)
        executor.remove_node(node)
        executor.shutdown()

    def start(node: Node) -> None:
        threads.append(threading.Thread(target=spin, args=(node,)))
        threads[-1].start()

    yield start
    ending.set()
    for thread in threads:
        thread.join()
