"""A catalogue brought up to date: what did not change is not read again, what was stopped goes on."""

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from engine_mount.fleet.away import StoreWatch, reason_of
from engine_mount.fleet.catalogue.columns import UNREADABLE
from engine_mount.fleet.catalogue.journal import Journal
from engine_mount.fleet.catalogue.places import Place, below, places
from engine_mount.fleet.catalogue.reading import fingerprint_of, read_place
from engine_mount.fleet.catalogue.rows import Row, Rows, unreadable
from engine_mount.fleet.catalogue.stored import read_rows, write_catalogue
from engine_mount.fleet.foreign import NOTHING_SAID, Said
from engine_mount.fleet.runner import run_tasks

if TYPE_CHECKING:
    import pyarrow

Told = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Indexed:
    """What came of it: the table of all recordings, and how many were read, unchanged, and are gone."""

    recordings: 'pyarrow.Table'
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
    told: Told = lambda done, of: None,
) -> Indexed:
    """Bring the catalogue in the folder `out` up to date with the recordings at and below `uris`.

    Recordings whose files have the same sizes, times and etags are not read again; those that are no more
    below `uris` leave the catalogue, those that lie elsewhere stay. Stopped by whatever, the same order goes
    on where it stopped. With mappings `said` of files of others these are rows too; without any only those
    that are named themselves. `told` takes how many are done, of how many; `scheduler`, `workers` and
    `memory` are those of `run_tasks`. Rows depend on the recordings, and `said`, alone. Raises
    `SourceError`, `SchedulerLostError`, and `OSError` where `out` cannot be written.
    """
    roots = [os.fspath(uri) for uri in uris]
    found = places(roots, others=said.is_known)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    kept = read_rows(folder)
    with Journal(folder) as journal:
        known = {
            uri: rows
            for uri, rows in (kept | journal.rows).items()
            if _is_current(rows, found.get(uri), said.mark)
        }
        waiting = [place for uri, place in found.items() if uri not in known]
        told(0, len(waiting))
        watch = StoreWatch()
        tasks = run_tasks(
            partial(read_place, said=said), waiting, scheduler=scheduler, workers=workers, memory=memory
        )
        for count, done in enumerate(tasks, 1):
            place = waiting[done.place]
            rows = done.result or unreadable(place, reason_of(done), fingerprint='')
            journal.add(place.uri, rows)
            watch.take(done)
            known[place.uri] = rows
            told(count, len(waiting))
        elsewhere = {uri: rows for uri, rows in kept.items() if not below(uri, roots)}
        recordings = write_catalogue(folder, known | elsewhere)
        journal.finish()
    return Indexed(
        recordings,
        read=len(waiting),
        unchanged=len(found) - len(waiting),
        vanished=len(kept.keys() - found.keys() - elsewhere.keys()),
        unreadable=sum(_is_unreadable(rows.recordings) for uri, rows in known.items() if uri in found),
    )


def _is_current(rows: Rows, place: Place | None, mark: str) -> bool:
    """Return whether rows tell of the files as they are now; what could not be fetched is tried again."""
    row = rows.recordings[0]
    return place is not None and row['fingerprint'] == fingerprint_of(place, row['kind'], mark)


def _is_unreadable(rows: list[Row]) -> bool:
    return rows[0]['kind'] == UNREADABLE
