"""Single key presses from a terminal, which is left as it was found, however the program ends."""

import os
import select
import signal
import sys
import termios
import time
import tty
from typing import Any

_ARROWS = {b'A': 'up', b'B': 'down', b'C': 'right', b'D': 'left'}
_PLAIN = {b' ': 'space', b'q': 'q', b'.': '.', b'm': 'm'}

MARK_KEYS = ('m', 'space')
"""Keys that set a mark while something is recorded."""


class Keyboard:
    """Keys while the context lasts; without a terminal there are none."""

    def __init__(self, stream: Any = None):
        self._stream = sys.stdin if stream is None else stream
        self._saved: list[Any] | None = None
        self._handlers: dict[int, Any] = {}
        self._unread = b''

    def __enter__(self) -> 'Keyboard':
        if self.present:
            self._saved = termios.tcgetattr(self._stream)
            # A signal that ended the process at once would leave the terminal without echo.
            for number in (signal.SIGTERM, signal.SIGHUP):
                if signal.getsignal(number) is signal.SIG_DFL:
                    self._handlers[number] = signal.signal(number, _interrupt)
            tty.setcbreak(self._stream)
        return self

    def __exit__(self, *_: object) -> None:
        if self._saved is not None:
            termios.tcsetattr(self._stream, termios.TCSADRAIN, self._saved)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    @property
    def present(self) -> bool:
        """Whether there is a terminal, and this process is in its foreground."""
        try:
            return bool(self._stream.isatty()) and _in_foreground(self._stream.fileno())
        except (AttributeError, ValueError):  # closed, or none at all
            return False

    def wait(self, duration: float) -> list[str]:
        """Wait up to `duration` s and return the keys pressed: `space`, `left`, `up`, ..., `q`, `.`, `m`."""
        if self._saved is None:
            time.sleep(duration)
            return []
        if not select.select([self._stream], [], [], duration)[0]:
            return []
        self._unread += os.read(self._stream.fileno(), 64)
        return self._keys()

    def _keys(self) -> list[str]:
        keys = []
        while self._unread:
            if self._unread[:2] == b'\x1b[':
                if len(self._unread) < 3:
                    break  # the rest of the arrow is under way
                key, self._unread = _ARROWS.get(self._unread[2:3]), self._unread[3:]
            else:
                key, self._unread = _PLAIN.get(self._unread[:1]), self._unread[1:]
            if key is not None:
                keys.append(key)
        return keys


def _in_foreground(terminal: int) -> bool:
    """Return whether the terminal's settings may be changed: a process in the background would be stopped."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the terminal that controls this process, so it cannot stop it
        return True


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt
