"""What a process of the graph gets from who started it: whom to end with, and its real-time priority.

Told by the environment, so that it holds for nodes of the supervisor and of `ros2 launch` alike; without it a
node stands for itself.
"""

import os
import select
import sys
from collections.abc import Sequence

_STARTER, _PRIORITY = 'ENGINE_MOUNT_STARTER', 'ENGINE_MOUNT_PRIORITY'


def environment_of_children(priority: int) -> dict[str, str]:
    """Return what processes need that shall end with this one and run their loops at `priority` (0: none)."""
    return {_STARTER: str(os.getpid()), _PRIORITY: str(priority)}


_TIED = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG of Linux, linux/prctl.h; it outlives exec
if os.getppid() != int(sys.argv[1]):  # it ended before
    sys.exit(1)
os.execvp(sys.argv[2], sys.argv[2:])
"""


def tied(command: Sequence[str]) -> list[str]:
    """Return the command that runs `command`, a program of others, and is killed when this process ends.

    By the kernel, whatever ends this process (prctl(2)): a process that knows its starter ends by itself. To
    be started by a thread that lives as long as this process; what `command` starts in turn is its own.
    """
    return [sys.executable, '-I', '-S', '-c', _TIED, str(os.getpid()), *command]


def given_priority() -> int:
    """Return the real-time priority at which the loop of this process is to run; 0: none."""
    return int(os.environ.get(_PRIORITY, '0'))


class Starter:
    """The process that started this one: without it a node must not go on driving the coil."""

    def __init__(self) -> None:
        self._end: list[int] = []  # a descriptor that can be read once it has ended
        self._had_ended = False
        number = os.environ.get(_STARTER)
        if number is not None:
            try:
                self._end = [os.pidfd_open(int(number))]
            except ProcessLookupError:
                self._had_ended = True

    def wait_beside(self, descriptor: int, period: float | None = None) -> bool:
        """Return whether there is something to read from `descriptor`.

        It waits for that, for the end of the starter, and for no longer than `period` s.
        """
        ready, _, _ = select.select([descriptor, *self._end], [], [], 0.0 if self._had_ended else period)
        return descriptor in ready

    @property
    def name(self) -> str:
        """The process, for people."""
        return f'the process that started this one ({os.environ.get(_STARTER, "none")})'

    @property
    def ended(self) -> bool:
        """Whether it has ended; never where none is known."""
        return self._had_ended or bool(select.select(self._end, [], [], 0.0)[0])
