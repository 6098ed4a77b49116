"""How Linux schedules the threads of this process, and keeps its memory in place."""

import contextlib
import ctypes
import os
import resource
import threading
import time
from math import nan
from pathlib import Path

_TASKS = Path('/proc/self/task')
_THREAD_CLOCK = 6  # per thread, processor time: CPUCLOCK_PERTHREAD_MASK | CPUCLOCK_SCHED of the Linux kernel
_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4  # MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT of Linux


class Threads:
    """The threads of this process, by the numbers that the system gives them."""

    def names(self) -> dict[int, str]:
        """Return {number: name} of all threads: Python's name where it has one, else the system's."""
        found = {}
        for task in _TASKS.iterdir():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
                found[int(task.name)] = (task / 'comm').read_text().strip()
        python = {thread.native_id: thread.name for thread in threading.enumerate()}
        return {number: python.get(number, name) for number, name in found.items()}

    def run(self, number: int, priority: int) -> None:
        """Run a thread at `priority` by SCHED_FIFO, 0: ordinarily; nothing is done where it has ended.

        The threads that it makes are ordinary ones. Raises `PermissionError`.
        """
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK if priority else os.SCHED_OTHER
        with contextlib.suppress(ProcessLookupError):
            os.sched_setscheduler(number, policy, os.sched_param(priority))

    def of_python(self) -> set[int]:
        """Return the numbers of the threads that take turns with the interpreter."""
        return {thread.native_id for thread in threading.enumerate() if thread.native_id is not None}

    def processor_time(self, number: int) -> float:
        """Return the processor time that a thread has used, s; NaN where it has ended."""
        try:
            return time.clock_gettime(~number << 3 | _THREAD_CLOCK)
        except OSError:
            return nan


def lock_memory() -> bool:
    """Keep every page of this process in memory from its first use on; return whether the system permits it.

    A loop at the highest priority waits for the disk like any other. Where memory is short or left unused for
    a while, the system takes pages of programs and libraries away and reads them again from the disk when
    they are wanted. (Beside eight programs that read much, the nodes of two mounts stood still for 0.2 to 3
    s, all threads at once.) Where only a part may be locked (RLIMIT_MEMLOCK) nothing is: beyond the limit the
    process would get no new memory.
    """
    _, highest = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if highest == resource.RLIM_INFINITY:
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (highest, highest))
    elif os.geteuid() != 0:
        return False
    return ctypes.CDLL(None).mlockall(_CURRENT | _FUTURE | _ON_FAULT) == 0


def limit_without_sleep(limit: float) -> None:
    """Let the system kill this process when a thread in real time has run for `limit` s without a sleep.

    A lower limit that is set already stays.
    """
    number = round(1e6 * limit)
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_RTTIME, (number, number))
