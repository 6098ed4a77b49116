"""Ctrl-C and its kin, handed to who can end in order instead of tearing what runs."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def ending_signals(end: Callable[[], None]) -> Iterator[None]:
    """Call `end` on SIGINT, SIGTERM and SIGHUP while the context lasts; it must take no lock."""
    before = {number: signal.getsignal(number) for number in _ENDING}
    if before[signal.SIGHUP] is signal.SIG_IGN:
        del before[signal.SIGHUP]  # nohup: the run outlives its terminal
    for number in before:
        signal.signal(number, lambda *_: end())
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
