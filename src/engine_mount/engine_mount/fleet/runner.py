"""Many independent tasks on processes of this machine or on a Dask cluster; results come as they are done."""

import contextlib
import ctypes
import logging
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Generic, TypeVar

from engine_mount.fleet.interrupts import remembered_interrupts

Item = TypeVar('Item')
Result = TypeVar('Result')

LOCAL = 'local'
LOSSES = 3
"""Workers that may be lost with a task before it is given up; chosen."""

_LOST = f'{LOSSES} workers were lost with it: killed, or out of memory'
_POLL = 0.1  # s, chosen: between two looks at an interrupt; a result ends the wait at once
_NICENESS = 10  # chosen: the user of the machine comes first
_MEMORY_CHECK = 0.1  # s, chosen
_PR_SET_PDEATHSIG = 1  # Linux, linux/prctl.h
_CONNECT, _CLOSE = 10.0, 10.0  # s, chosen: limits for the scheduler of a cluster
_OF_WORKERS = (
    'OMP_NUM_THREADS',
    'OPENBLAS_NUM_THREADS',
    'MKL_NUM_THREADS',
    'NUMBA_NUM_THREADS',
    'PYTHONSAFEPATH',
)
_LOGGERS = ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio')
_GROUP_LIMIT = Path('/sys/fs/cgroup/memory.max')  # cgroups(7)


class SchedulerLostError(ConnectionError):
    """A Dask cluster does not answer, or no longer does; the text says which."""


@dataclass(frozen=True)
class Done(Generic[Result]):
    """The task at `place` of a sequence: its result, or the reason why there is none.

    `error` is the exception of the task; None where its workers were lost.
    """

    place: int
    result: Result | None
    reason: str = ''
    error: BaseException | None = None


def run_tasks(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    scheduler: str = LOCAL,
    workers: int = 0,
    memory: int = 0,
) -> Iterator[Done[Result]]:
    """Yield `work(item)` of each item as it is done, in any order.

    `scheduler` is `local` (`workers` processes of this machine, 0 for one on each core; each ends beyond
    `memory` bytes, 0 for its share of the machine's) or the address of a Dask cluster, tcp://HOST:PORT. One
    that raises is a `Done` with its reason. A task whose worker is lost is run again, at the end, and given
    up after `LOSSES` workers. Raises `SchedulerLostError` where the cluster does not answer, and
    `ChildProcessError` where no process can start.
    """
    if not items:
        return
    with remembered_interrupts() as raise_lost:
        if scheduler == LOCAL:
            yield from _run_here(work, items, processes_for(workers, len(items)), memory, raise_lost)
        else:
            yield from _run_on_cluster(work, items, scheduler, raise_lost)


def processes_for(workers: int, tasks: int) -> int:
    """Return how many processes of this machine work at a time; `workers` 0 is one for each core."""
    return min(workers or len(os.sched_getaffinity(0)), tasks)


class _Worker:
    """A process with a pipe of its own: killed while it sends a result, it holds up no other one."""

    def __init__(self, memory: int):
        context = multiprocessing.get_context('spawn')  # this process may hold threads of middleware
        self.pipe, theirs = context.Pipe()
        self.place: int | None = None
        """Which task it does."""
        self.is_ready = False
        self._process = context.Process(target=_serve, args=(theirs, os.getpid(), memory), daemon=True)
        with _environment_of_workers():
            self._process.start()
        theirs.close()

    def begin(self, place: int, task: bytes) -> None:
        """Hand over a task; a worker that is lost by then is noticed by its pipe."""
        self.place = place
        with contextlib.suppress(OSError):
            self.pipe.send_bytes(task)

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _run_here(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    threads: int,
    memory: int,
    raise_lost: Callable[[], None],
) -> Iterator[Done[Result]]:
    import cloudpickle  # only where tasks leave this process

    limit = memory or _memory_of_machine() // (os.cpu_count() or 1)
    waiting, losses, failed_starts = deque(range(len(items))), Counter[int](), 0
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.place is not None for worker in workers):
            while waiting and len(workers) < threads:
                workers.append(_Worker(limit))
            for worker in workers:
                if waiting and worker.place is None:
                    place = waiting.popleft()
                    worker.begin(place, cloudpickle.dumps((work, items[place])))
            busy: dict[Any, _Worker] = {worker.pipe: worker for worker in workers if worker.place is not None}
            for pipe in wait(list(busy), _POLL):
                worker = busy[pipe]
                assert worker.place is not None
                try:
                    answer = worker.pipe.recv()
                except (EOFError, OSError):
                    workers.remove(worker)
                    worker.end()
                    failed_starts = 0 if worker.is_ready else failed_starts + 1
                    _check_starts(failed_starts)
                    losses[worker.place] += 1
                    if losses[worker.place] < LOSSES:
                        waiting.append(worker.place)
                    else:
                        yield Done(worker.place, None, _LOST)
                    continue
                worker.is_ready = True
                if answer is not None:
                    place, worker.place = worker.place, None
                    yield _done(place, *answer)
            raise_lost()
    finally:
        for worker in workers:
            worker.end()


def _check_starts(failed: int) -> None:
    """Raise `ChildProcessError` where no worker could begin to work, several times in a row."""
    if failed >= LOSSES:
        raise ChildProcessError(
            f'no worker process could start in {LOSSES} attempts: a script needs the line '
            "if __name__ == '__main__' where it starts workers; else check the memory of this machine"
        )


def _done(place: int, result: Any, error: BaseException | None) -> Done[Any]:
    if error is None:
        return Done(place, result)
    return Done(place, None, f'{type(error).__name__}: {error}', error)


@contextlib.contextmanager
def _environment_of_workers() -> Iterator[None]:
    """Set for processes that start meanwhile: one thread, no imports from the working directory, no Ctrl-C.

    Threads and processes inherit which signals are blocked: Ctrl-C reaches this process alone.
    """
    before = {name: os.environ.get(name) for name in _OF_WORKERS}
    os.environ.update(dict.fromkeys(_OF_WORKERS, '1'))
    resource_tracker.ensure_running()  # its start, with the first process, would unblock the signal
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


def _memory_of_machine() -> int:
    """Return how many bytes this machine has, or its group of processes may take."""
    whole = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE')
    with contextlib.suppress(OSError, ValueError):  # no group, or one without a limit
        return min(whole, int(_GROUP_LIMIT.read_text(encoding='ascii')))
    return whole


def _serve(pipe: Connection, starter: int, memory: int) -> None:
    """Do pickled tasks from a pipe, one after the other, until it is closed."""
    _prepare_worker(starter, memory)
    pipe.send(None)  # it has begun to work
    with contextlib.suppress(EOFError):
        while True:
            pipe.send_bytes(_perform(pipe.recv_bytes()))


def _prepare_worker(starter: int, memory: int) -> None:
    """Tie this process to its starter, lower its priority, and end it beyond `memory` bytes."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != starter:  # it ended before
        os.kill(os.getpid(), signal.SIGKILL)
    os.nice(_NICENESS)
    threading.Thread(target=_limit_memory, args=(memory,), name='memory', daemon=True).start()


def _limit_memory(memory: int) -> None:
    page = os.sysconf('SC_PAGE_SIZE')
    while True:
        with open('/proc/self/statm', encoding='ascii') as file:  # proc(5)
            if int(file.read().split()[1]) * page > memory:
                os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(_MEMORY_CHECK)


def _perform(task: bytes) -> bytes:
    """Return result and error of a pickled task, an error in a form that other processes can load."""
    try:
        work, item = pickle.loads(task)
        return pickle.dumps((work(item), None))
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # an exception of a library may raise anything there
            error = RuntimeError(f'{type(error).__name__}: {error}')
        return pickle.dumps((None, error))


def _run_on_cluster(
    work: Callable[[Item], Result], items: Sequence[Item], address: str, raise_lost: Callable[[], None]
) -> Iterator[Done[Result]]:
    import cloudpickle
    from distributed import KilledWorker, as_completed

    left = len(items)
    with _quiet_dask(), _client(address) as client:
        try:
            futures = client.map(_perform, [cloudpickle.dumps((work, item)) for item in items], pure=False)
            places = {future.key: place for place, future in enumerate(futures)}
            arriving = as_completed(futures, loop=client.loop)
            del futures  # a result is dropped from the cluster once it is here
            while left:
                arrived = arriving.next_batch(block=False)
                if not arrived:
                    with arriving.thread_condition:
                        arriving.thread_condition.wait(_POLL)
                    raise_lost()
                for future in arrived:
                    place = places[future.key]
                    try:
                        done = _done(place, *pickle.loads(future.result()))
                    except (CancelledError, KilledWorker):
                        client.nthreads()  # raises where it was the scheduler that was lost
                        done = Done(place, None, _LOST)
                    except OSError:
                        raise  # of the connection
                    except Exception as error:  # a worker cannot load its task
                        done = _done(place, None, error)
                    left -= 1
                    yield done
        except OSError as error:
            raise SchedulerLostError(
                f'the scheduler ({address}) was lost with {left} tasks under way; what was done until then '
                f'stands ({error})'
            ) from None


@contextlib.contextmanager
def _client(address: str) -> Iterator[Any]:
    """Give a client of the cluster at `address`.

    It is left within `_CLOSE` s: after an interrupt inside Dask its `close` was seen to wait for ever.
    """
    from distributed import Client

    try:
        client = Client(address, timeout=_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise SchedulerLostError(f'{address}: no Dask scheduler answers there ({error})') from None

    def close() -> None:
        with contextlib.suppress(Exception):
            client.close()

    try:
        yield client
    finally:
        closing = threading.Thread(target=close, daemon=True)
        closing.start()
        closing.join(_CLOSE)


@contextlib.contextmanager
def _quiet_dask() -> Iterator[None]:
    """Keep Dask's log to itself: what a user needs to know comes with the results."""
    import distributed  # noqa: F401  # it sets its levels when it is loaded

    loggers = [logging.getLogger(name) for name in _LOGGERS]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
