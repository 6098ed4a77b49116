"""What a process of the graph gets from who started it: whom to end with, and its real-time priority.

Told by the environment, so that it holds for nodes of the supervisor and of `ros2 launch` alike; without it a
node stands for itself.
"""

import contextlib
import os
import select

_STARTER, _PRIORITY = 'ENGINE_MOUNT_STARTER', 'ENGINE_MOUNT_PRIORITY'


def environment_of_children(priority: int) -> dict[str, str]:
    """Return what processes that this one starts need to end with it, and to run at `priority` (0: none)."""
    return {_STARTER: str(os.getpid()), _PRIORITY: str(priority)}


def take_priority() -> None:
    """Run this thread, and those it will make, at the priority given, as SCHED_FIFO.

    To be called before the middleware makes its threads, so that those that receive inherit it; those that
    send again are taken out by `mount_ros.nodes.scheduling`. Where not permitted nothing changes.
    """
    priority = int(os.environ.get(_PRIORITY, '0'))
    if priority:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


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

    def wait_beside(self, descriptor: int) -> None:
        """Return when there is something to read from `descriptor`, or the starter has ended."""
        if not self._had_ended:
            select.select([descriptor, *self._end], [], [])

    @property
    def ended(self) -> bool:
        """Whether it has ended; never where none is known."""
        return self._had_ended or bool(select.select(self._end, [], [], 0.0)[0])
