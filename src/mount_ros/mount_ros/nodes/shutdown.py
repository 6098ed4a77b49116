"""The last steps of a process: nodes and context are taken down within a limit, shared memory is removed.

Fast DDS 2.14 has been seen to wait for itself there for ever. On a machine too busy to keep up, its event
thread and the thread that destroyed an endpoint each held what the other one needed. A participant that is
destroyed while it learns of the end of another waits for that with a lock which the other thread needs, and
rclpy keeps the interpreter meanwhile. By then the work is done, the coil is at 0 A and the recording is
closed; all that is left is to end.
"""

import contextlib
import ctypes
import fcntl
import os
import re
import struct
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

_LIMIT = 5.0  # s, chosen: it takes some 0.1 s, on a busy machine 1 s
_LAST = 10.0  # s, chosen: then the C library ends the process, which needs no interpreter
_THREAD = 'leave_middleware'

SHARED_MEMORY = Path('/dev/shm')
_YOUNGEST = 2.0  # s, chosen: a process has locked the files that it makes by then
_SEGMENT = re.compile(r'fastrtps_(?:[0-9a-f]{16}|port\d{1,5})')


def leave_middleware(
    take_down: Callable[[], None], limit: float = _LIMIT, code: int = 1, last: float = _LAST
) -> bool:
    """Call `take_down` and return True, or False if it has not come to its end after `limit` s.

    An exception in it is the caller's. After False only `end_process` ends the process for certain. Where it
    keeps the interpreter this does not return: after `last` s the process ends with `code`.
    """
    raised: list[BaseException] = []

    def attempt() -> None:
        try:
            take_down()
        except BaseException as error:
            raised.append(error)

    sys.stdout.flush()
    sys.stderr.flush()
    deadline = Deadline(code)
    deadline.set(last)
    thread = threading.Thread(target=attempt, name=_THREAD, daemon=True)
    thread.start()
    thread.join(limit)
    deadline.close()
    if raised:
        raise raised[0]
    return not thread.is_alive()


def end_process(code: int) -> NoReturn:
    """End with this exit code, past the middleware's own clearing up where that would wait for ever."""
    if any(thread.name == _THREAD for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


_SIGEV_THREAD = 2  # Linux, asm-generic/siginfo.h


class Deadline:
    """Lets the C library end this process with `code` at a time, whatever holds the interpreter then."""

    def __init__(self, code: int):
        self._library = ctypes.CDLL(None, use_errno=True)
        end = ctypes.cast(self._library._exit, ctypes.c_void_p).value
        # `struct sigevent`: the argument, no signal, a function to be called, and its attributes
        event = struct.pack('P2iP40x', code, 0, _SIGEV_THREAD, end)
        self._timer = ctypes.c_void_p()
        if self._library.timer_create(time.CLOCK_MONOTONIC, event, ctypes.byref(self._timer)) != 0:
            raise OSError(ctypes.get_errno(), 'a timer that ends this process cannot be made')

    def set(self, limit: float) -> None:
        """End the process `limit` s from now on, not when it was set before; 0: never."""
        seconds = int(limit)
        once = (ctypes.c_long * 4)(0, 0, seconds, round(1e9 * (limit - seconds)))
        if self._library.timer_settime(self._timer, 0, once, None) != 0:
            raise OSError(ctypes.get_errno(), 'a timer that ends this process cannot be set')

    def close(self) -> None:
        """Call it off."""
        self._library.timer_delete(self._timer)


def remove_abandoned(folder: Path = SHARED_MEMORY, youngest: float = _YOUNGEST) -> list[str]:
    """Remove shared memory of Fast DDS in `folder` that no living process owns; return these files, sorted.

    Measured: each participant makes a segment, whether or not anything goes by it. One that ends in order
    removes it and the lock of its port, not the port itself; one that is killed leaves all of it. An owner
    holds its lock file (`_el`, `_sl`) as long as it lives, so what can be locked, and a port without a lock,
    belongs to nobody. `fastdds shm clean` does the same but for such ports. What is younger than `youngest`
    (s), and what cannot be removed, such as another user's, is left.
    """
    removed: list[str] = []
    with contextlib.suppress(OSError):
        names = set(os.listdir(folder))
        old = sorted(name for name in names if _age(folder / name) >= youngest)
        for name in old:
            segment, kind = name[:-3], name[-3:]
            if kind in ('_el', '_sl') and _SEGMENT.fullmatch(segment):
                with contextlib.suppress(OSError), open(folder / name, 'rb') as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # held while the files go
                    removed += _remove(folder, segment, f'sem.{segment}_mutex', name)
            elif _SEGMENT.fullmatch(name) and 'port' in name and not {f'{name}_el', f'{name}_sl'} & names:
                removed += _remove(folder, name, f'sem.{name}_mutex')
    return sorted(removed)


def remove_abandoned_of_the_dead() -> list[str]:
    """Do the same for processes that have just died: once what they had made last is old enough."""
    time.sleep(_YOUNGEST)
    return remove_abandoned()


def _remove(folder: Path, *names: str) -> list[str]:
    removed = []
    for name in names:
        with contextlib.suppress(OSError):
            (folder / name).unlink()
            removed.append(name)
    return removed


def _age(path: Path) -> float:
    """Return how long ago (s) a file was written, negative where it is gone."""
    try:
        return time.time() - path.stat().st_mtime
    except OSError:
        return -1.0
