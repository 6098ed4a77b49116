"""A catalogue: what each of many recordings is and holds, brought up to date."""

import os
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from engine_mount.fleet.catalogue.columns import EVENTS, RECORDINGS, UNREADABLE
from engine_mount.fleet.catalogue.places import below, places
from engine_mount.fleet.catalogue.reading import not_fetched, read_place
from engine_mount.fleet.foreign import NOTHING_SAID, Said
from engine_mount.fleet.job import Progress, TableJob

if TYPE_CHECKING:
    import pyarrow


@dataclass(frozen=True, eq=False)
class Indexed:
    """What came of it: the tables, and how many recordings were read, unchanged, vanished and unreadable."""

    recordings: 'pyarrow.Table'
    events: 'pyarrow.Table'
    read: int
    unchanged: int
    vanished: int
    unreadable: int


def indexed(
    uris: Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    said: Said = NOTHING_SAID,
    *,
    scheduler: str = 'local',
    workers: int = 0,
    memory: int = 0,
    progress: Callable[[Progress], None] = lambda progress: None,
) -> Indexed:
    """Bring the catalogue in the folder `out` up to date with the recordings at and below `uris`.

    Recordings whose files have the same sizes, times and etags are not read again; those that are no more
    below `uris` leave the catalogue, those that lie elsewhere stay. An interrupted call goes on where it
    stopped. With mappings `said` foreign files are rows too, without any only those that are named
    themselves. `scheduler`, `workers` and `memory` are those of `run_tasks`. Rows depend on the recordings,
    and `said`, alone. Raises `SourceError`, `SchedulerLostError`, `OrderError` and `WritingError`.
    """
    roots = [os.fspath(uri) for uri in uris]
    found = places(roots, others=said.is_known)
    job = TableJob(Path(out), {'recordings': RECORDINGS, 'events': EVENTS}, ('uri', 'mount'))
    with job.opened():
        known = set(job.answers)
        left = job.left(list(found.values()), said.mark)
        answers = job.run(
            left,
            partial(read_place, said=said),
            not_fetched,
            progress,
            of=len(found),
            scheduler=scheduler,
            workers=workers,
            memory=memory,
        )
        deque(answers, maxlen=0)
        elsewhere = {uri for uri in known if not below(uri, roots)}
        tables = job.finish(found.keys() | elsewhere)
        kinds = [job.answers[uri].rows['recordings'][0]['kind'] for uri in found]
    return Indexed(
        **tables,
        read=len(left),
        unchanged=len(found) - len(left),
        vanished=len(known - found.keys() - elsewhere),
        unreadable=kinds.count(UNREADABLE),
    )
