"""Tasks on a Dask cluster, by its address."""

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from typing import Any

from engine_mount.fleet.worker import Batch, WorkerLostError, run_in_turn

_CLOSE = 10.0  # s, chosen: it takes 0.1 to 2 s
_CONNECT = 10.0  # s, chosen: for an answer of the scheduler
_LOGGERS = ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio')


class SchedulerLostError(ConnectionError):
    """A Dask cluster does not answer, or no longer does; the text says which."""


class ClusterWorkers:
    """The workers of the cluster at `address`; raises `SchedulerLostError` where no scheduler answers."""

    def __init__(self, address: str):
        from distributed import Client, as_completed

        self._address = address
        try:
            self._client = Client(address, timeout=_CONNECT, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise SchedulerLostError(f'{address}: no Dask scheduler answers there ({error})') from None
        self._arriving = as_completed(loop=self._client.loop, with_results=True, raise_errors=False)
        self._under_way: dict[Any, int] = {}  # future: number of its tasks

    @property
    def threads(self) -> int:
        """How many tasks the cluster does at a time."""
        with self._noticed():
            return max(sum(self._client.nthreads().values()), 1)

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Any:
        """Hand over some tasks that one worker does in turn."""
        with self._noticed():
            future = self._client.submit(run_in_turn, work, items, pure=False)
            self._under_way[future] = len(items)
            self._arriving.add(future)
        return future

    def arrived(self, limit: float) -> list[tuple[Any, Batch[Any] | BaseException]]:
        """Return what is done within `limit` s: a batch, why there is none, or `WorkerLostError`."""
        with self._noticed():
            batch = self._arriving.next_batch(block=False)
            if not batch:
                with self._arriving.thread_condition:
                    self._arriving.thread_condition.wait(limit)
                batch = self._arriving.next_batch(block=False)
            found = [(future, self._result(future, result)) for future, result in batch]
        for future, _ in found:
            self._under_way.pop(future, None)
        return found

    def close(self) -> None:
        """Leave the cluster within `_CLOSE` s; what is left then ends with this process.

        After an interrupt amid Dask's own work it was seen to wait for ever.
        """

        def close() -> None:
            with contextlib.suppress(Exception):
                self._client.close()

        closing = threading.Thread(target=close, daemon=True)
        closing.start()
        closing.join(_CLOSE)

    def _result(self, future: Any, result: Any) -> Any:
        from distributed import KilledWorker

        if isinstance(result, CancelledError):
            self._client.nthreads()  # raises where it was the scheduler that was lost
            return WorkerLostError()
        if future.status != 'error':
            return result
        return WorkerLostError() if isinstance(result[1], KilledWorker) else result[1]

    @contextlib.contextmanager
    def _noticed(self) -> Iterator[None]:
        """Raise `SchedulerLostError` where the scheduler is lost."""
        try:
            yield
        except OSError as error:
            raise SchedulerLostError(
                f'the scheduler ({self._address}) was lost with {sum(self._under_way.values())} tasks under '
                f'way; what was done until then stands ({error})'
            ) from None


@contextlib.contextmanager
def quiet_dask() -> Iterator[None]:
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
