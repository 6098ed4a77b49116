"""The last steps of a process: nodes and context are taken down within a limit, shared memory is removed.

Fast DDS 2.14 has been seen to wait for itself there for ever. On a machine too busy to keep up, its event
thread and the thread that destroyed an endpoint each held what the other one needed. A participant that is
destroyed while it learns of the end of another waits for that with a lock which the other thread needs, and
rclpy keeps the interpreter meanwhile. By then the work is done, the coil is at 0 A and the recording is
closed; all that is left is to end.
"""

import contextlib
import faulthandler
import fcntl
import os
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


def leave_middleware(take_down: Callable[[], None], limit: float = _LIMIT, last: float = _LAST) -> bool:
    """Call `take_down` and return True, or False if it has not come to its end after `limit` s.

    An exception in it is the caller's. After False only `end_process` ends the process for certain. Where it
    keeps the interpreter this does not return: after `last` s the process ends with code 1.
    """
    raised: list[BaseException] = []

    def attempt() -> None:
        try:
            take_down()
        except BaseException as error:
            raised.append(error)

    sys.stdout.flush()
    end_after(last)
    thread = threading.Thread(target=attempt, name=_THREAD, daemon=True)
    thread.start()
    thread.join(limit)
    end_after(0.0)
    if raised:
        raise raised[0]
    return not thread.is_alive()


def end_process(code: int) -> NoReturn:
    """End with this exit code, past the middleware's own clearing up where that would wait for ever."""
    if any(thread.name == _THREAD for thread in threading.enumerate()):
        sys.stdout.flush()
        os._exit(code)
    sys.exit(code)


def end_after(limit: float) -> None:
    """End this process with code 1 after `limit` s, whatever holds the interpreter then; 0: never."""
    if limit:
        faulthandler.dump_traceback_later(limit, exit=True, file=2)
    else:
        faulthandler.cancel_dump_traceback_later()


def remove_abandoned(folder: Path = SHARED_MEMORY, youngest: float = _YOUNGEST) -> None:
    """Remove shared memory of Fast DDS in `folder` that no living process owns.

    Measured: each participant makes a segment, whether or not anything goes by it. One that ends in order
    removes it and the lock of its port, not the port itself; one that is killed leaves all of it. An owner
    holds its lock file (`_el`, `_sl`) as long as it lives, so what can be locked belongs to nobody. What is
    younger than `youngest` (s), and what cannot be removed, such as another user's, is left.
    """
    names = {path.name.removesuffix('_el').removesuffix('_sl') for path in folder.glob('fastrtps_*')}
    for name in names:
        every = [folder / each for each in (name, f'{name}_el', f'{name}_sl', f'sem.{name}_mutex')]
        with contextlib.suppress(OSError), contextlib.ExitStack() as held:  # while the files go
            files = [file for file in every if file.exists()]
            for file in files:
                fcntl.flock(held.enter_context(open(file, 'rb')), fcntl.LOCK_EX | fcntl.LOCK_NB)
            if files and time.time() - max(file.stat().st_mtime for file in files) >= youngest:
                for file in files:
                    file.unlink()


def remove_abandoned_of_the_dead() -> None:
    """Do the same for processes that have just died: once what they had made last is old enough."""
    time.sleep(_YOUNGEST)
    remove_abandoned()
