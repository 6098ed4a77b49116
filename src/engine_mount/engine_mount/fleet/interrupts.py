"""Interrupts that are raised where the main thread waits, if they were lost before."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from mount_bringup.graph.shutdown import raise_interrupt


@contextmanager
def remembered_interrupts() -> Iterator[Callable[[], None]]:
    """Yield a function that raises `KeyboardInterrupt` if one came while the context lasts, and was lost.

    None is raised in a destructor. For who waits again and again in the main thread; in another thread, or
    where SIGINT is ignored, nothing is changed.
    """
    came: list[int] = []

    def remember(number: int, frame: FrameType | None) -> None:
        came.append(number)
        raise_interrupt(frame)

    def raise_lost() -> None:
        if came:
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield raise_lost
        return
    signal.signal(signal.SIGINT, remember)
    try:
        yield raise_lost
    finally:
        signal.signal(signal.SIGINT, before)
