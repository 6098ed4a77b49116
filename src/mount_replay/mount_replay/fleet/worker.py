"""A process of this machine that works for `runner.run_tasks`; imported only where Dask is at work."""

import contextlib
import os

from distributed import Nanny, Worker

_NICENESS = 10  # chosen: who works at the machine comes first
_LEAVE = 0.05  # s, chosen: so long a process may take to leave by itself before it is killed


class Process(Nanny):
    """Watches a worker process, starts it again when it is lost, ends it without waiting for its task."""

    async def kill(self, timeout: float = _LEAVE, reason: str = 'nanny-kill') -> None:
        """End the process, after `timeout` (s, at most `_LEAVE`) by SIGKILL."""
        # SIGKILL was sent by then: on a busy machine the process is gone later, and the run has not failed
        with contextlib.suppress(TimeoutError):
            await super().kill(timeout=min(timeout, _LEAVE), reason=reason)


def dask_setup(worker: Worker) -> None:
    """Make a new worker process yield to what people do at the machine; Dask calls it."""
    os.nice(_NICENESS)
