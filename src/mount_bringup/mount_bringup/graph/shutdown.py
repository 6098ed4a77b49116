"""Turns SIGINT, SIGTERM and SIGHUP into an orderly shutdown."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""The exit code of a command that the user has ended, as a shell reports SIGINT."""


class Interrupted(Exception):  # noqa: N818 - no error: the user ends it
    """The user ended the run; the text, if any, says what stands then."""


_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_pending: list[int] = []  # interrupts that came outside `ending_signals`


def interrupt_and_remember(number: int, frame: FrameType | None) -> None:
    """Raise `KeyboardInterrupt`, and hand it on if it is lost: a handler for SIGINT.

    Amid the import of a library it can be lost: some take every exception for something that is missing.
    In a destructor Python would print and drop it.
    """
    _pending.append(number)
    while frame is not None:
        if frame.f_code.co_name == '__del__':
            return
        frame = frame.f_back
    raise KeyboardInterrupt


@contextmanager
def ending_signals(end: Callable[[], None]) -> Iterator[None]:
    """Call `end` on SIGINT, SIGTERM and SIGHUP while the context lasts; it must take no lock."""
    before = {number: signal.getsignal(number) for number in _ENDING}
    if before[signal.SIGHUP] is signal.SIG_IGN:
        del before[signal.SIGHUP]  # nohup: the run outlives its terminal
    for number in before:
        signal.signal(number, lambda *_: end())
    try:
        if _pending:
            _pending.clear()
            end()
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
