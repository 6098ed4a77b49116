"""Turns SIGINT, SIGTERM and SIGHUP into an orderly shutdown."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""The exit code of a command that the user has ended, as a shell reports SIGINT."""


class Interrupted(Exception):  # noqa: N818 - no error: the user ends it
    """The user ended the run; the text, if any, says what stands then."""


_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_unheard: list[int] = []  # interrupts that came while nobody was there who can end in order


def interrupt_and_remember(number: int, frame: FrameType | None) -> None:
    """Raise `KeyboardInterrupt`, and hand it on if it is lost: a handler for SIGINT.

    Amid the import of a library it can be lost: some take every exception for something that is missing.
    """
    _unheard.append(number)
    _interrupt(frame)


def _interrupt(frame: FrameType | None) -> None:
    """Raise `KeyboardInterrupt`, but not in a destructor: Python would print and drop it there."""
    while frame is not None:
        if frame.f_code.co_name == '__del__':
            return
        frame = frame.f_back
    raise KeyboardInterrupt


@contextmanager
def remembered_interrupts() -> Iterator[Callable[[], None]]:
    """Yield a function that raises `KeyboardInterrupt` if one came while the context lasts, and was lost.

    None is raised in a destructor. For who waits again and again in the main thread; in another thread, or
    where SIGINT is ignored, nothing is changed.
    """
    came: list[int] = []

    def remember(number: int, frame: FrameType | None) -> None:
        came.append(number)
        _interrupt(frame)

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


@contextmanager
def ending_signals(end: Callable[[], None]) -> Iterator[None]:
    """Call `end` on SIGINT, SIGTERM and SIGHUP while the context lasts; it must take no lock."""
    before = {number: signal.getsignal(number) for number in _ENDING}
    if before[signal.SIGHUP] is signal.SIG_IGN:
        del before[signal.SIGHUP]  # nohup: the run outlives its terminal
    for number in before:
        signal.signal(number, lambda *_: end())
    try:
        if _unheard:
            _unheard.clear()
            end()
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
