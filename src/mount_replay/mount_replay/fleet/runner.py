"""Many independent tasks on Dask's `distributed`, whose results come as they are done."""

import pickle
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from mount_replay.fleet.cluster import LOCAL, SchedulerLostError, connected
from mount_replay.fleet.interrupts import remembered_interrupts

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar('Item')
Result = TypeVar('Result')

LOSSES = 3
"""So many workers may be lost with a task before it is given up; chosen."""
_LOOK = 0.1  # s, chosen, as Dask does itself: what arrives ends the wait at once
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
        connected(scheduler, workers, len(items), memory) as client,
    ):
        stream = _Stream(client, work, items, raise_lost)
        try:
            yield from stream.results()
        except OSError as error:
            raise SchedulerLostError(
                f'the scheduler ({scheduler}) was lost with {stream.under_way} tasks under way; what was '
                f'done until then stands ({error})'
            ) from None


@dataclass(frozen=True)
class _Batch(Generic[Result]):
    """What came of the first of several tasks, in `seconds`; `error` is what the last of these raised."""

    results: list[Result]
    error: Exception | None
    seconds: float


def _in_turn(work: Callable[[Item], Result], items: Sequence[Item]) -> _Batch[Result]:
    """Do several tasks at a worker, up to the first that raises."""
    begin = time.monotonic()
    results: list[Result] = []
    for item in items:
        try:
            result = work(item)
        except Exception as error:  # whatever it is, it is told as what became of its task
            return _Batch(results, _portable(error), time.monotonic() - begin)
        results.append(result)
    return _Batch(results, None, time.monotonic() - begin)


def _portable(error: Exception) -> Exception:
    """Return an error, or where it cannot be sent to another process one with its words."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # what an error of others raises there is not known
        return RuntimeError(f'{type(error).__name__}: {error}')
    return error


class _Stream(Generic[Item, Result]):
    """The tasks of one call on one cluster."""

    def __init__(
        self,
        client: 'Client',
        work: Callable[[Item], Result],
        items: Sequence[Item],
        raise_lost: Callable[[], None],
    ):
        from distributed import as_completed

        self._client, self._work, self._items = client, work, items
        self._raise_lost = raise_lost
        self._arriving = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        self._waiting = deque(range(len(items)))
        self._under_way: dict[Any, list[int]] = {}  # future: places of its items
        self._seconds = _BATCH  # of a task in the batch that was done last
        self._alone: dict[int, int] = {}  # place: workers lost with it; to be done at the end

    @property
    def under_way(self) -> int:
        """Tasks that were handed over and are not done."""
        return sum(map(len, self._under_way.values()))

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
        threads = max(sum(self._client.nthreads().values()), 1)
        while self._waiting and len(self._under_way) < _AHEAD * threads:
            share = len(self._waiting) // (_AHEAD * threads)
            count = max(min(int(_BATCH / self._seconds), _MOST, share), 1)
            self._submit([self._waiting.popleft() for _ in range(count)])

    def _submit(self, places: list[int]) -> None:
        items = [self._items[place] for place in places]
        future = self._client.submit(_in_turn, self._work, items, pure=False)
        self._under_way[future] = places
        self._arriving.add(future)

    def _arrived(self) -> Iterator[Done[Result]]:
        from distributed import KilledWorker

        for future, result in self._next_batch():
            is_lost = isinstance(result, CancelledError)
            if is_lost:
                self._client.nthreads()  # raises where it was the scheduler that was lost
            places = self._under_way.pop(future)
            error = result[1] if future.status == 'error' and not is_lost else None
            if is_lost or isinstance(error, KilledWorker):
                yield from self._given_up(places)
            elif error is not None:  # a worker did not understand its task, or cannot send its result
                yield from self._failed(places, error)
            else:
                yield from self._told(places, result)

    def _told(self, places: list[int], batch: _Batch[Result]) -> Iterator[Done[Result]]:
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

    def _next_batch(self) -> list[Any]:
        """Return what has arrived, one at least; raises `KeyboardInterrupt` where Dask lost one."""
        while not (batch := self._arriving.next_batch(block=False)):
            self._raise_lost()
            with self._arriving.thread_condition:
                self._arriving.thread_condition.wait(_LOOK)
        return batch


def _reason(error: BaseException) -> str:
    return f'{type(error).__name__}: {error}'
