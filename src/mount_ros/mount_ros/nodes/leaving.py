"""The last steps of a process: nodes and context are taken down, within a limit.

Fast DDS 2.14 has been seen to wait for itself there for ever: on a machine too busy to keep up, its event
thread and the thread that destroyed an endpoint each held what the other one needed. By then the work is
done, the coil is at 0 A and the recording is closed; all that is left is to end.
"""

import os
import sys
import threading
from collections.abc import Callable
from typing import NoReturn

_LIMIT = 5.0  # s, chosen: it takes some 0.1 s, on a busy machine 1 s
_THREAD = 'leave_middleware'


def leave_middleware(take_down: Callable[[], None], limit: float = _LIMIT) -> bool:
    """Call `take_down` and return True, or False if it has not come to its end after `limit` s.

    An exception in it is the caller's. After False only `end_process` ends the process for certain.
    """
    raised: list[BaseException] = []

    def attempt() -> None:
        try:
            take_down()
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=attempt, name=_THREAD, daemon=True)
    thread.start()
    thread.join(limit)
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
