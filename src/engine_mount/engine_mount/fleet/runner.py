"""Many independent tasks on several processes, whose results come as they are done."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from engine_mount.fleet.interrupts import remembered_interrupts
from engine_mount.fleet.processes import LOCAL, LocalWorkers, processes_for
from engine_mount.fleet.worker import Batch, WorkerLostError

Item = TypeVar('Item')
Result = TypeVar('Result')

LOSSES = 3
"""So many workers may be lost with a task before it is given up; chosen."""
_LOOK = 0.1  # s, chosen: what arrives ends the wait at once
_AHEAD = 4  # batches per thread that are handed over at a time, chosen: one runs, the others wait
_BATCH = 0.25  # s, chosen: to hand over a batch costs some 7 ms of processor time, here and at the worker
_MOST = 16  # tasks in a batch, chosen: so many begin anew where an interrupt or a lost worker ends it


@dataclass(frozen=True)
class Done(Generic[Result]):
    """The task at `place` of what was given: its result, or the reason why there is none.

    `error` is what it raised; None where its workers were lost.
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
    """Return each task as it is done, in any order: `work` is a function of a module, without state.

    `scheduler` is `local` (processes of this machine, `workers` of them, 0 for one on each core, each of
    which is replaced beyond `memory` bytes, 0 for its share of the machine's) or the address of a Dask
    cluster, tcp://HOST:PORT. A task that raises is a `Done` with its reason; one whose worker is lost is run
    again, at the end and alone, and given up when `LOSSES` workers were lost with it. Few tasks are handed
    over at a time, short ones several together: who takes results slowly holds the others up. Raises
    `SchedulerLostError` where the cluster does not answer or no longer does; what was returned until then
    stands.
    """
    if not items:
        return
    with (
        remembered_interrupts() as raise_lost,
        _workers(scheduler, workers, len(items), memory) as hands,
    ):
        yield from _Stream(hands, work, items, raise_lost).results()


class Workers(Protocol):
    """What does tasks: processes of this machine, or a cluster."""

    @property
    def threads(self) -> int:
        """How many tasks are done at a time."""

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> Any:
        """Hand over some tasks that one worker does in turn; return what `arrived` knows them by."""

    def arrived(self, limit: float) -> list[tuple[Any, Batch[Any] | BaseException]]:
        """Return what is done within `limit` s: a batch, why there is none, or `WorkerLostError`."""

    def close(self) -> None:
        """End what was started."""


@contextmanager
def _workers(scheduler: str, workers: int, tasks: int, memory: int) -> Iterator[Workers]:
    with ExitStack() as stack:
        opened: Workers
        if scheduler == LOCAL:
            opened = LocalWorkers(processes_for(workers, tasks), memory)
        else:
            from engine_mount.fleet.cluster import ClusterWorkers, quiet_dask

            stack.enter_context(quiet_dask())
            opened = ClusterWorkers(scheduler)
        stack.callback(opened.close)
        yield opened


class _Stream(Generic[Item, Result]):
    """The tasks of one call on its workers."""

    def __init__(
        self,
        workers: Workers,
        work: Callable[[Item], Result],
        items: Sequence[Item],
        raise_lost: Callable[[], None],
    ):
        self._workers, self._work, self._items = workers, work, items
        self._raise_lost = raise_lost
        self._waiting = deque(range(len(items)))
        self._under_way: dict[Any, list[int]] = {}  # future: places of its items
        self._seconds = _BATCH  # of a task in the batch that was done last
        self._alone: dict[int, int] = {}  # place: workers lost with it; to be done at the end

    def results(self) -> Iterator[Done[Result]]:
        """Return all tasks as they are done, those last whose worker was lost."""
        self._fill()
        while self._under_way:
            yield from self._arrived()
            self._fill()
        # alone, so that no task is blamed for the worker that another one took along
        for place in sorted(self._alone):
            done: list[Done[Result]] = []
            while not done:
                self._submit([place])
                done = list(self._arrived())
            yield from done

    def _fill(self) -> None:
        """Hand over what waits, as far as there is room; towards the end fewer at once: all end together."""
        threads = self._workers.threads
        while self._waiting and len(self._under_way) < _AHEAD * threads:
            share = len(self._waiting) // (_AHEAD * threads)
            count = max(min(int(_BATCH / self._seconds), _MOST, share), 1)
            self._submit([self._waiting.popleft() for _ in range(count)])

    def _submit(self, places: list[int]) -> None:
        future = self._workers.submit(self._work, [self._items[place] for place in places])
        self._under_way[future] = places

    def _arrived(self) -> Iterator[Done[Result]]:
        for future, result in self._next():
            places = self._under_way.pop(future)
            if isinstance(result, WorkerLostError):
                yield from self._given_up(places)
            elif isinstance(result, BaseException):  # a worker cannot load its task, or send its result
                yield from self._failed(places, result)
            else:
                yield from self._told(places, result)

    def _told(self, places: list[int], batch: Batch[Result]) -> Iterator[Done[Result]]:
        """Return what came of a batch; what stands behind a task that raised waits again."""
        done = len(batch.results)
        for place, result in zip(places, batch.results, strict=False):
            yield Done(place, result)
        if batch.error is not None:
            yield Done(places[done], None, _reason(batch.error), batch.error)
            done += 1
        self._waiting.extendleft(reversed(places[done:]))
        self._seconds = max(batch.seconds / done, _BATCH / _MOST)

    def _failed(self, places: list[int], error: BaseException) -> Iterator[Done[Result]]:
        """Return the failure of a task; of several together each is done again, alone."""
        if len(places) == 1:
            yield Done(places[0], None, _reason(error), error)
        else:
            self._alone |= dict.fromkeys(places, 0)

    def _given_up(self, places: list[int]) -> Iterator[Done[Result]]:
        """Count the loss of a worker with tasks, and return those that are given up."""
        for place in places:
            self._alone[place] = self._alone.get(place, 0) + 1
            if self._alone[place] >= LOSSES:
                yield Done(place, None, f'{LOSSES} workers were lost with it: killed, or out of memory')

    def _next(self) -> list[tuple[Any, Batch[Result] | BaseException]]:
        """Return what has arrived, one at least; raises `KeyboardInterrupt` where one was lost."""
        while not (arrived := self._workers.arrived(_LOOK)):
            self._raise_lost()
        return arrived


def _reason(error: BaseException) -> str:
    return f'{type(error).__name__}: {error}'
