"""How the threads of this process are scheduled, as Linux tells it and lets it be set."""

import contextlib
import os
import threading
import time
from pathlib import Path

_TASKS = Path('/proc/self/task')
_THREAD_CLOCK = 6  # per thread, processor time: CPUCLOCK_PERTHREAD_MASK | CPUCLOCK_SCHED of the Linux kernel


class Threads:
    """The threads of this process, by the numbers that the system gives them."""

    own = property(lambda self: threading.get_native_id(), doc='The number of the calling thread.')

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

    def waits(self, number: int) -> bool:
        """Return whether a thread that wants to run has no processor, or runs just now."""
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            return (_TASKS / str(number) / 'stat').read_text().rsplit(')', 1)[1].split()[0] == 'R'
        return False

    def processor_time(self, number: int) -> float:
        """Return the processor time that a thread has used, s; NaN where it has ended."""
        try:
            return time.clock_gettime(~number << 3 | _THREAD_CLOCK)
        except OSError:
            return float('nan')


def drop_real_time() -> int:
    """Run all threads of this process ordinarily; return the real-time priority that they had, 0: none.

    A process started in real time would import, compile and look for its peers before all others of the
    machine, and wait in vain there for any of lower priority.
    """
    highest = 0
    for number in (int(task.name) for task in _TASKS.iterdir()):
        with contextlib.suppress(ProcessLookupError):
            highest = max(highest, os.sched_getparam(number).sched_priority)
            if os.sched_getparam(number).sched_priority:
                os.sched_setscheduler(number, os.SCHED_OTHER, os.sched_param(0))
    return highest


def started_in_real_time(priority: int) -> str:
    """Return what is said of a process that `drop_real_time` has found at a `priority`."""
    return f'started at real-time priority {priority}, now ordinary: only loops of active nodes have it'
