"""Many independent tasks on processes of this machine or on a Dask cluster; results come as they are done.

The processes have a pipe each and no pool of `concurrent.futures`: there the reader of results waits for ever
for the rest of one whose process was killed while it sent it.
"""

import contextlib
import ctypes
import logging
import multiprocessing
import os
import pickle
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

LOCAL = 'local'
LOSSES = 3
"""Workers that may be lost with a task before it is given up; chosen."""

_LOST = f'{LOSSES} workers were lost with it: killed, or out of memory'
_NICENESS = 10  # chosen: the user of the machine comes first
_PR_SET_PDEATHSIG = 1  # Linux, linux/prctl.h
_LIMIT = 10.0  # s, chosen: for a cluster to answer, and to be left
_OF_WORKERS = (
    'OMP_NUM_THREADS',
    'OPENBLAS_NUM_THREADS',
    'MKL_NUM_THREADS',
    'NUMBA_NUM_THREADS',
    'PYTHONSAFEPATH',
)
_LOGGERS = ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio')


class SchedulerLostError(ConnectionError):
    """A Dask cluster does not answer, or no longer does; the text says which."""


class Done(NamedTuple):
    """The task at `place` of a sequence: its result, or the reason why there is none.

    `error` is the exception of the task; None where its workers were lost.
    """

    place: int
    result: Any
    reason: str = ''
    error: BaseException | None = None


def run_tasks(
    work: Callable[[Any], Any], items: Sequence[Any], *, scheduler: str = LOCAL, workers: int = 0
) -> Iterator[Done]:
    """Yield `work(item)` of each item as it is done, in any order.

    `scheduler` is `local` (`workers` processes of this machine, 0 for one on each core) or the address of a
    Dask cluster, tcp://HOST:PORT. One that raises is a `Done` with its reason. A task whose worker is lost is
    run again, at the end, and given up after `LOSSES` workers. Raises `SchedulerLostError` where the cluster
    does not answer, and `ChildProcessError` where no process can start.
    """
    if not items:
        return iter(())
    if scheduler == LOCAL:
        return _run_here(work, items, min(workers or len(os.sched_getaffinity(0)), len(items)))
    return _run_on_cluster(work, items, scheduler)


class _Worker:
    """A process with a pipe of its own: killed while it sends a result, it holds up no other one."""

    def __init__(self) -> None:
        context = multiprocessing.get_context('spawn')  # this process may hold threads of middleware
        self.pipe, theirs = context.Pipe()
        self.is_ready = False
        self._process = context.Process(target=_serve, args=(theirs, os.getpid()), daemon=True)
        with _environment_of_workers():
            self._process.start()
        theirs.close()

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _run_here(work: Callable, items: Sequence[Any], count: int) -> Iterator[Done]:
    import cloudpickle  # only where tasks leave this process

    waiting, losses, failed_starts = deque(range(len(items))), Counter[int](), 0
    workers: dict[Any, _Worker] = {}  # by their pipes
    under_way: dict[Any, int] = {}
    try:
        while waiting or under_way:
            while waiting and len(workers) < count:
                worker = _Worker()
                workers[worker.pipe] = worker
            for pipe in list(workers.keys() - under_way)[: len(waiting)]:
                under_way[pipe] = waiting.popleft()
                with contextlib.suppress(OSError):  # a worker that is lost by then is noticed below
                    pipe.send_bytes(cloudpickle.dumps((work, items[under_way[pipe]])))
            for pipe in wait(list(under_way)):
                worker, place = workers[pipe], under_way[pipe]
                try:
                    answer = worker.pipe.recv()
                except (EOFError, OSError):
                    del workers[pipe], under_way[pipe]
                    worker.end()
                    failed_starts = 0 if worker.is_ready else failed_starts + 1
                    if failed_starts == LOSSES:
                        raise ChildProcessError(
                            f'no worker process could start in {LOSSES} attempts: a script needs the line '
                            "if __name__ == '__main__' where it starts workers; else check the memory of "
                            'this machine'
                        ) from None
                    losses[place] += 1
                    if losses[place] < LOSSES:
                        waiting.append(place)
                    else:
                        yield Done(place, None, _LOST)
                    continue
                if worker.is_ready:
                    del under_way[pipe]
                    yield _done(place, *answer)
                worker.is_ready = True
    finally:
        for worker in workers.values():
            worker.end()


def _done(place: int, result: Any, error: BaseException | None) -> Done:
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
            del os.environ[name]
            if value is not None:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


def _serve(pipe: Connection, starter: int) -> None:
    """Do pickled tasks from a pipe, one after the other, until it is closed.

    The process has a low priority, ends with its starter, and is the first to end where memory does.
    """
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != starter:  # it ended before
        os.kill(os.getpid(), signal.SIGKILL)
    os.nice(_NICENESS)
    Path('/proc/self/oom_score_adj').write_text('1000', encoding='ascii')  # proc(5)
    pipe.send(None)  # it has begun to work
    with contextlib.suppress(EOFError):
        while True:
            pipe.send_bytes(_perform(pipe.recv_bytes()))


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


def _run_on_cluster(work: Callable, items: Sequence[Any], address: str) -> Iterator[Done]:
    import cloudpickle
    from distributed import Client, KilledWorker, as_completed

    for name in _LOGGERS:  # what a user needs to know comes with the results
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=_LIMIT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise SchedulerLostError(f'{address}: no Dask scheduler answers there ({error})') from None
    left = len(items)
    try:
        futures = client.map(_perform, [cloudpickle.dumps((work, item)) for item in items], pure=False)
        places = {future.key: place for place, future in enumerate(futures)}
        arriving = as_completed(futures, loop=client.loop)
        del futures  # a result is dropped from the cluster once it is here
        for future in arriving:
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
    finally:  # after an interrupt inside Dask its `close` was seen to wait for ever
        closing = threading.Thread(target=client.close, daemon=True)
        closing.start()
        closing.join(_LIMIT)
