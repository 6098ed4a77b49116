"""Where tasks run: processes of this machine, or a Dask cluster by its address."""

import contextlib
import logging
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from distributed import Client

LOCAL = 'local'
_CLOSE = 10.0  # s, chosen: it takes 0.1 to 2 s
_CONNECT = 10.0  # s, chosen: for an answer of the scheduler
_THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS')
_LOGGERS = ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio')


class SchedulerLostError(ConnectionError):
    """A Dask cluster does not answer, or no longer does; the text says which."""


@contextlib.contextmanager
def connected(scheduler: str, workers: int, tasks: int, memory: int) -> Iterator['Client']:
    """Yield a client of `scheduler`; what was started for it ends with the context, and with this process.

    `workers` and `memory` (bytes for each worker) as in `runner.run_tasks`; more workers than tasks are not
    started. Raises `SchedulerLostError` where no scheduler answers.
    """
    with _quiet():
        if scheduler == LOCAL:
            with (
                _processes(processes_for(workers, tasks), memory) as cluster,
                _ended(_client(cluster)) as client,
            ):
                yield client
            return
        try:
            context = _client(scheduler)
        except (OSError, TimeoutError, ValueError) as error:
            raise SchedulerLostError(f'{scheduler}: no Dask scheduler answers there ({error})') from None
        with _ended(context) as client:
            yield client


def processes_for(workers: int, tasks: int) -> int:
    """Return how many processes of this machine work at a time; `workers` 0 is one for each core."""
    return min(workers or len(os.sched_getaffinity(0)), tasks)


def _client(where: Any) -> 'Client':
    from distributed import Client

    return Client(where, timeout=_CONNECT, set_as_default=False)


@contextlib.contextmanager
def _processes(count: int, memory: int) -> Iterator[Any]:
    """Yield a cluster of `count` processes of this machine, one thread each, that no other one can reach."""
    import dask
    from distributed import LocalCluster

    from mount_replay.fleet.worker import Process

    with (
        tempfile.TemporaryDirectory(prefix='engine_mount_fleet_') as scratch,
        dask.config.set(_configuration(scratch)),
        _environment(dict.fromkeys((*_THREADS, 'PYTHONSAFEPATH'), '1')),  # none from the working directory
    ):
        # Threads and processes inherit which signals are blocked: Ctrl-C reaches this process alone.
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            cluster = LocalCluster(
                n_workers=0,
                threads_per_worker=1,
                worker_class=Process,
                host='127.0.0.1',
                dashboard_address=None,
                scheduler_kwargs={'dashboard_address': '127.0.0.1:0'},
                silence_logs=logging.CRITICAL,
                memory_limit=memory or 'auto',
                preload=['mount_replay.fleet.worker'],
            )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        with _ended(cluster):
            cluster.scale(count)
            yield cluster


@contextlib.contextmanager
def _ended(opened: Any) -> Iterator[Any]:
    """Yield what has a `close`, and close it within `_CLOSE` s; what is left then ends with this process.

    After an interrupt amid Dask's own work it was seen to wait for ever.
    """

    def close() -> None:
        with contextlib.suppress(Exception):
            opened.close()

    try:
        yield opened
    finally:
        closing = threading.Thread(target=close, daemon=True)
        closing.start()
        closing.join(_CLOSE)


def _configuration(scratch: str) -> dict[str, Any]:
    return {
        'temporary-directory': scratch,
        'distributed.admin.large-graph-warning-threshold': '1GB',  # items are few at a time
        'distributed.scheduler.http.routes': [],
        'distributed.worker.http.routes': [],
        'distributed.scheduler.allowed-failures': 0,  # the runner counts them
        'distributed.scheduler.worker-saturation': 1.0,
        'distributed.worker.profile.enabled': False,  # its samples cost some per cent, and nothing reads them
        # Dask's own limit lets each array of more than 128 KiB be mapped anew, page by page.
        'distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_': None,
        'distributed.worker.multiprocessing-method': 'spawn',  # this process may hold threads of middleware
        # Nothing is kept at a worker, so there is nothing to spill; a worker that is too large is replaced.
        'distributed.worker.memory.target': False,
        'distributed.worker.memory.spill': False,
        'distributed.worker.memory.pause': False,
        'distributed.worker.memory.terminate': 1.0,
    }


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, for the processes that are started meanwhile."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's log to itself: what a user needs to know comes with the results."""
    import distributed  # noqa: F401  # it sets its levels when it is loaded

    # It is never heard: at exit it tells of processes that were killed a moment ago.
    logging.getLogger('distributed.process').setLevel(logging.CRITICAL)
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
