"""The key that sets a mark, read from a terminal that is left as it was found."""

import contextlib
import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator

_MARKS = b'm '


@contextlib.contextmanager
def mark_keys() -> Iterator[Callable[[float], int] | None]:
    """Give a function that waits up to so many s and returns how often `m` or space was pressed.

    None without a terminal in whose foreground this process is. To be used within `ending_signals`: a signal
    that ended the process at once would leave the terminal without echo.
    """
    stream = sys.stdin
    if not (stream and not stream.closed and stream.isatty() and _in_foreground(stream.fileno())):
        yield None
        return

    def pressed(duration: float) -> int:
        if not select.select([stream], [], [], duration)[0]:
            return 0
        return sum(key in _MARKS for key in os.read(stream.fileno(), 64))

    saved = termios.tcgetattr(stream)
    tty.setcbreak(stream)
    try:
        yield pressed
    finally:
        termios.tcsetattr(stream, termios.TCSADRAIN, saved)


def _in_foreground(terminal: int) -> bool:
    """Return whether the terminal's settings may be changed: a process in the background would be stopped."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the terminal that controls this process, so it cannot stop it
        return True
