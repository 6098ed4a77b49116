"""Tasks on processes of this machine, over pipes: no port is opened, so nobody else can hand them work."""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from mount_replay.fleet.worker import Batch, WorkerLostError, prepare_worker, run_pickled

LOCAL = 'local'

_THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS')
_STARTS = 3  # in a row without one worker that works, after which none is tried again; chosen
_LIMIT_OF_GROUP = Path('/sys/fs/cgroup/memory.max')  # cgroups(7)


def processes_for(workers: int, tasks: int) -> int:
    """Return how many processes of this machine work at a time; `workers` 0 is one for each core."""
    return min(workers or len(os.sched_getaffinity(0)), tasks)


class LocalWorkers:
    """`threads` processes, each replaced beyond `memory` bytes (0: its share of the machine's).

    A lost worker takes all tasks that are under way along; a new pool follows. Of one thread: the kernel ends
    workers with the thread that started them.
    """

    def __init__(self, threads: int, memory: int):
        self.threads = threads
        self._memory = memory or _memory_of_machine() // (os.cpu_count() or 1)
        self._pool: ProcessPoolExecutor | None = None
        self._first: Future[int] | None = None
        self._processes: set[Any] = set()
        self._failed_starts = 0
        self._under_way: set[Future[Batch[Any]]] = set()

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Future[Batch[Any]]:
        """Hand over some tasks that one worker does in turn."""
        import cloudpickle  # only where tasks leave this process

        task = cloudpickle.dumps((work, items))
        future: Future[Batch[Any]]
        try:
            future = self._handed_over(run_pickled, task)
        except BrokenProcessPool as error:  # since the last look
            future = Future()
            future.set_exception(error)
        self._under_way.add(future)
        return future

    def arrived(self, limit: float) -> list[tuple[Any, Batch[Any] | BaseException]]:
        """Return what is done within `limit` s: a batch, why there is none, or `WorkerLostError`."""
        done, self._under_way = wait(self._under_way, limit, FIRST_COMPLETED)
        found = [(future, future.exception() or future.result()) for future in done]
        if any(isinstance(result, BrokenProcessPool) for _, result in found):
            self.close()
            self._count_start()
            rest, self._under_way = self._under_way, set()  # done with the pool
            found += [(future, future.exception() or future.result()) for future in rest]
        return [
            (future, WorkerLostError() if isinstance(result, BrokenProcessPool) else result)
            for future, result in found
        ]

    def close(self) -> None:
        """End all workers without waiting for their tasks.

        All of them: a killed one may hold the lock that the others need to end by themselves.
        """
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in self._processes:
                process.kill()
            pool.shutdown(wait=True, cancel_futures=True)

    def _handed_over(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit to the pool, which starts another process as long as it has too few."""
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self.threads,
                multiprocessing.get_context('spawn'),  # this process may hold threads of middleware
                prepare_worker,
                (os.getpid(), self._memory),
            )
            self._processes, self._first = set(), None
            self._first = self._handed_over(os.getpid)
        others = set(multiprocessing.active_children()) - self._processes
        with _inherited_by_workers():
            future = self._pool.submit(function, *arguments)
        self._processes = set(multiprocessing.active_children()) - others
        return future

    def _count_start(self) -> None:
        """Raise `ChildProcessError` where no worker could begin to work, several times in a row."""
        first = self._first
        is_failed = first is None or not first.done() or first.exception() is not None
        self._failed_starts = self._failed_starts + 1 if is_failed else 0
        if self._failed_starts == _STARTS:
            raise ChildProcessError(
                f'no worker process could start in {_STARTS} attempts: a script that starts workers needs '
                "the line if __name__ == '__main__'; else check the memory of this machine"
            )


@contextlib.contextmanager
def _inherited_by_workers() -> Iterator[None]:
    """Set for processes started meanwhile: one thread each, no imports from the working directory, no Ctrl-C.

    Threads and processes inherit which signals are blocked: Ctrl-C reaches this process alone.
    """
    values = dict.fromkeys((*_THREADS, 'PYTHONSAFEPATH'), '1')
    before = {name: os.environ.get(name) for name in values}
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


def _memory_of_machine() -> int:
    """Return how many bytes this machine has, or its group of processes may take."""
    whole = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE')
    with contextlib.suppress(OSError, ValueError):  # no group, or one without a limit
        return min(whole, int(_LIMIT_OF_GROUP.read_text(encoding='ascii')))
    return whole
