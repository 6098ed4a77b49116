"""Which threads of a process may run in real time."""

import contextlib
import os
from pathlib import Path

_RESENDING = 'dds.asyn'  # names of threads of Fast DDS


def calm_resending() -> None:
    """Take the middleware's threads that send again out of real-time scheduling, if the process is in it.

    They spin while a receiver's buffer is full: in real time two of them kept that receiver, and a whole
    machine with two cores, from running ever again.
    """
    for thread in resending_threads():
        with contextlib.suppress(ProcessLookupError):  # it has just ended
            os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


def resending_threads() -> list[int]:
    """Return the ids of this process's threads in which the middleware sends again what was not taken."""
    found = []
    for task in Path('/proc/self/task').iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
            if (task / 'comm').read_text().startswith(_RESENDING):
                found.append(int(task.name))
    return found
