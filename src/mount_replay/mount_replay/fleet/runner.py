"""Many independent tasks on Dask's `distributed`, whose results come as they are done."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from mount_bringup.graph.ending_signals import remembered_interrupts
from mount_replay.fleet.cluster import LOCAL, SchedulerLostError, connected

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar('Item')
Result = TypeVar('Result')

LOSSES = 3
"""So many workers may be lost with a task before it is given up; chosen."""
_LOOK = 0.1  # s, chosen, as Dask does itself: what arrives ends the wait at once
_AHEAD = (
    4  # tasks per thread that are handed over at a time, chosen: those that run, and as many again that wait
)


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
    over at a time: who takes results slowly holds the others up. Raises `SchedulerLostError` where the
    cluster does not answer or no longer does; what was returned until then stands.
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
        self._under_way: dict[Any, int] = {}  # future: place of its item
        self._losses: dict[int, int] = {}  # place: workers lost with it

    @property
    def under_way(self) -> int:
        """Tasks that were handed over and are not done."""
        return len(self._under_way)

    def results(self) -> Iterator[Done[Result]]:
        """Return all tasks as they are done, those last whose worker was lost."""
        waiting = iter(range(len(self._items)))
        self._submit(islice(waiting, self._room()))
        while self._under_way:
            yield from self._arrived()
            self._submit(islice(waiting, self._room()))
        # alone, so that no task is blamed for the worker that another one took along
        for place in sorted(self._losses):
            done: list[Done[Result]] = []
            while not done:
                self._submit([place])
                done = list(self._arrived())
            yield from done

    def _room(self) -> int:
        threads = sum(self._client.nthreads().values())
        return max(_AHEAD * max(threads, 1) - len(self._under_way), 0)

    def _submit(self, places: Any) -> None:
        for place in places:
            future = self._client.submit(self._work, self._items[place], pure=False)
            self._under_way[future] = place
            self._arriving.add(future)

    def _arrived(self) -> Iterator[Done[Result]]:
        from distributed import KilledWorker

        for future, result in self._next_batch():
            is_lost = isinstance(result, CancelledError)
            if is_lost:
                self._client.nthreads()  # raises where it was the scheduler that was lost
            place = self._under_way.pop(future)
            error = result[1] if future.status == 'error' and not is_lost else None
            if error is None and not is_lost:
                yield Done(place, result)
            elif error is not None and not isinstance(error, KilledWorker):
                yield Done(place, None, f'{type(error).__name__}: {error}', error)
            else:
                self._losses[place] = self._losses.get(place, 0) + 1
                if self._losses[place] >= LOSSES:
                    reason = f'{LOSSES} workers were lost with it: killed, or out of memory'
                    yield Done(place, None, reason)

    def _next_batch(self) -> list[Any]:
        """Return what has arrived, one at least; raises `KeyboardInterrupt` where Dask lost one."""
        while not (batch := self._arriving.next_batch(block=False)):
            self._raise_lost()
            with self._arriving.thread_condition:
                self._arriving.thread_condition.wait(_LOOK)
        return batch
