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
    for task in Path('/proc/self/task').iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # a thread that has just ended
            if (task / 'comm').read_text().startswith(_RESENDING):
                os.sched_setscheduler(int(task.name), os.SCHED_OTHER, os.sched_param(0))
