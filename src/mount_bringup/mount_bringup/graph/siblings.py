"""The processes of a graph that launch has started, as another of its children sees them."""

import contextlib
import os
import select
import signal
from collections.abc import Sequence
from pathlib import Path

from mount_bringup.graph.nodes import GraphNode
from mount_bringup.graph.processes import NODES_OF_PROCESS


class Sibling:
    """A process of the same parent in which `nodes` live; its number can be no other's while this is held."""

    def __init__(self, nodes: Sequence[GraphNode], pid: int):
        self.nodes = tuple(nodes)
        self.pid = pid
        self._descriptor = os.pidfd_open(pid)

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return bool(select.select([self._descriptor], [], [], 0.0)[0])

    def kill(self) -> None:
        """End the process, also one that stands still."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._descriptor, signal.SIGKILL)

    def close(self) -> None:
        """Let go of the process."""
        os.close(self._descriptor)


def sibling_of(nodes: Sequence[GraphNode]) -> Sibling | None:
    """Return the process of `nodes` that the parent of this process has started; None if there is none.

    By its environment, which its starter has given it: no message can make this process end another one.
    """
    parent = str(os.getppid())
    wanted = f'{NODES_OF_PROCESS}={" ".join(node.full_name for node in nodes)}'.encode()
    for process in Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError):  # it has just ended, or is another user's
            if (process / 'stat').read_text().rpartition(')')[2].split()[1] != parent:
                continue
            if wanted in (process / 'environ').read_bytes().split(b'\0'):
                return Sibling(nodes, int(process.name))
    return None
