"""Ctrl-C and its kin, handed to who can end in order instead of tearing what runs."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_unheard: list[int] = []  # interrupts that came while nobody was there who can end in order


def interrupt_and_remember(number: int, *_: Any) -> None:
    """Raise `KeyboardInterrupt`, and hand it on if it is lost: a handler for SIGINT.

    Amid the import of a library it can be lost: some take every exception for something that is missing.
    """
    _unheard.append(number)
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
        if _unheard:
            _unheard.clear()
            end()
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
