"""Long work asked for by a service, while the executor goes on serving the others."""

import threading
from collections.abc import Callable
from typing import TypeVar

from rclpy.executors import Executor

SPIN_PERIOD = 60.0
"""Longest sleep of an executor, s (chosen): it is woken when it shall end; this is for when it is not."""

T = TypeVar('T')


def wake(executor: Executor) -> None:
    """End the `spin_once` of another thread; `Executor.wake` alone lets it look and sleep on."""
    executor.create_task(_nothing)


def run_in_thread(executor: Executor, work: Callable[[], T], name: str) -> T:
    """Return what `work` returns, done in a thread `name`, while `executor` serves in this one.

    It is called in a callback of the executor. Nothing of the same callback group is served meanwhile.
    """
    results: list[T] = []
    raised: list[BaseException] = []
    over = threading.Event()

    def attempt() -> None:
        try:
            results.append(work())
        except BaseException as error:
            raised.append(error)
        finally:
            over.set()
            wake(executor)

    thread = threading.Thread(target=attempt, name=name)
    thread.start()
    try:
        while not over.is_set():
            executor.spin_once(SPIN_PERIOD)
    finally:
        thread.join()
    if raised:
        raise raised[0]
    return results[0]


def _nothing() -> None:
    """Something to do."""
