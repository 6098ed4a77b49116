"""Tasks on processes of this machine, over pipes: no port is opened, so nobody else can hand them work."""

import contextlib
import itertools
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from engine_mount.fleet.worker import Batch, WorkerLostError, serve

LOCAL = 'local'

_THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS')
_STARTS = 3  # in a row without one worker that works, after which none is tried again; chosen
_LIMIT_OF_GROUP = Path('/sys/fs/cgroup/memory.max')  # cgroups(7)


def processes_for(workers: int, tasks: int) -> int:
    """Return how many processes of this machine work at a time; `workers` 0 is one for each core."""
    return min(workers or len(os.sched_getaffinity(0)), tasks)


class _Worker:
    """A process with a pipe of its own: when it is lost, no other one is."""

    def __init__(self, memory: int):
        context = multiprocessing.get_context('spawn')  # this process may hold threads of middleware
        self.pipe, theirs = context.Pipe()
        self.task: int | None = None
        """The number of the task that it does."""
        self.is_ready = False
        """Whether it has begun to work."""
        self._process = context.Process(target=serve, args=(theirs, os.getpid(), memory), daemon=True)
        with _inherited_by_workers():
            self._process.start()
        theirs.close()

    def begin(self, number: int, task: bytes) -> None:
        """Hand over a task; a worker that is lost by then is noticed by its pipe."""
        self.task = number
        with contextlib.suppress(OSError):
            self.pipe.send_bytes(task)

    def result(self) -> Batch[Any] | BaseException | None:
        """Return what came of its task, None where it has but begun to work."""
        try:
            found: Batch[Any] | BaseException | None = self.pipe.recv()
        except (EOFError, OSError):
            return WorkerLostError()
        self.is_ready = True
        if found is not None:
            self.task = None
        return found

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


class LocalWorkers:
    """At most `threads` processes, each replaced beyond `memory` bytes (0: its share of the machine's).

    Of one thread: the kernel ends workers with the thread that started them.
    """

    def __init__(self, threads: int, memory: int):
        self.threads = threads
        self._memory = memory or _memory_of_machine() // (os.cpu_count() or 1)
        self._workers: list[_Worker] = []
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._numbers = itertools.count()
        self._failed_starts = 0

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> int:
        """Hand over some tasks that one worker does in turn."""
        import cloudpickle  # only where tasks leave this process

        number = next(self._numbers)
        self._waiting.append((number, cloudpickle.dumps((work, items))))
        self._begin_waiting()
        return number

    def arrived(self, limit: float) -> list[tuple[Any, Batch[Any] | BaseException]]:
        """Return what is done within `limit` s: a batch, why there is none, or `WorkerLostError`."""
        busy: dict[Any, _Worker] = {
            worker.pipe: worker for worker in self._workers if worker.task is not None
        }
        found: list[tuple[Any, Batch[Any] | BaseException]] = []
        for pipe in wait(list(busy), limit):
            worker = busy[pipe]
            number, result = worker.task, worker.result()
            if isinstance(result, WorkerLostError):
                self._workers.remove(worker)
                worker.end()
                self._count_start(worker)
            else:
                self._failed_starts = 0
            if result is not None:
                found.append((number, result))
        self._begin_waiting()
        return found

    def close(self) -> None:
        """End all workers without waiting for their tasks."""
        while self._workers:
            self._workers.pop().end()

    def _begin_waiting(self) -> None:
        """Give waiting tasks to idle workers; start another one as long as there are too few."""
        while self._waiting:
            worker = next((each for each in self._workers if each.task is None), None)
            if worker is None:
                if len(self._workers) == self.threads:
                    return
                worker = _Worker(self._memory)
                self._workers.append(worker)
            worker.begin(*self._waiting.popleft())

    def _count_start(self, lost: _Worker) -> None:
        """Raise `ChildProcessError` where no worker could begin to work, several times in a row."""
        if lost.is_ready:
            return
        self._failed_starts += 1
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
    os.environ.update(values)
    resource_tracker.ensure_running()  # its start, with the first process, would unblock the signal
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
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
