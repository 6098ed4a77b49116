"""The tables of a fleet's folder, made recording by recording: each is read once, whatever ends a run.

journal.jsonl   a line for each recording that is done, with the fingerprint of its files
order.json      of a result: what was ordered; another order is refused
NAME.parquet    a table, written whole once the order is done
"""

import contextlib
import fcntl
import json
import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO

from engine_mount.fleet.places import Place
from engine_mount.fleet.runner import run_tasks
from engine_mount.fleet.tables import COLUMNS, Row, explained_errors, replaced, table_of, write_table
from engine_mount.signals.sources.source import StoreAwayError
from engine_mount.signals.sources.stores import local_copy

if TYPE_CHECKING:
    import pyarrow

Rows = Mapping[str, Sequence[Row]]
"""{table: rows}."""

JOURNAL, ORDER = 'journal.jsonl', 'order.json'
OUTAGES = 4
"""Recordings in a row for which a store does not answer, after which a run ends; chosen."""


class OrderError(ValueError):
    """A folder cannot take the rows of an order; the text says why, and what would help."""


class Answer(NamedTuple):
    """The rows of one recording, and what they took.

    `fingerprint` is that of its files, '' where a later run has to try again; `busy`: processor time in s;
    `worker`: the process.
    """

    rows: Rows
    fingerprint: str = ''
    busy: float = 0.0
    worker: str = ''


class JobProgress(NamedTuple):
    """Recordings that are done of how many, and the rate (1/s) of those that this run reads."""

    done: int
    of: int
    rate: float = 0.0


class Finished(NamedTuple):
    """The tables of a folder by their names, and the answers of which they are made, by URI.

    `read` are those of this run, `vanished` is the number of those that were forgotten; `starting` (s): until
    the first came.
    """

    tables: 'dict[str, pyarrow.Table]'
    answers: dict[str, Answer]
    read: list[Answer]
    vanished: int
    starting: float


class TableJob:
    """The tables of a folder, made of `rows_of(path, place)` of each recording, sorted by `key` and mount.

    `rows_of_failure(place, reason)` are the rows of one that could not be read; a later run tries it again.
    """

    def __init__(
        self,
        folder: Path,
        tables: Sequence[str],
        key: str,
        rows_of: Callable[[Path, Place], Rows],
        rows_of_failure: Callable[[Place, str], Rows],
    ):
        self._folder, self._key = folder, key
        self._columns = {table: COLUMNS[table] for table in tables}
        self._rows_of, self._rows_of_failure = rows_of, rows_of_failure

    def run(
        self,
        places: Sequence[Place],
        progress: Callable[[JobProgress], None],
        order: Mapping[str, Any] | None = None,
        stays: Callable[[str], bool] = lambda uri: False,
        **options: Any,
    ) -> Finished:
        """Read the recordings that are new or have changed; write and return the tables of all.

        A recording that is not among `places` is forgotten unless its URI `stays`. `options` are those of
        `run_tasks`. Raises `OrderError`, `WritingError`, `SchedulerLostError`, and `StoreAwayError` after
        `OUTAGES` recordings in a row whose store does not answer; what was done until then stands.
        """
        with self._opened(order) as journal:
            known = self._read_journal()
            here = {place.uri for place in places}
            kept = here | {uri for uri in known if stays(uri)}
            left = [
                place
                for place in places
                if place.uri not in known or known[place.uri].fingerprint != place.fingerprint
            ]
            vanished, read = len(known.keys() - kept), []
            begin, starting = time.monotonic(), 0.0
            done = len(places) - len(left)
            progress(JobProgress(done, len(places)))
            for place, answer in self._answers(left, options):
                starting = starting or time.monotonic() - begin
                known[place.uri] = answer
                read.append(answer)
                if answer.fingerprint:
                    with explained_errors(self._folder / JOURNAL):
                        journal.write(_line(place.uri, answer))
                        journal.flush()
                rate = len(read) / max(time.monotonic() - begin, 1e-9)
                progress(JobProgress(done + len(read), len(places), rate))
            answers = {uri: known[uri] for uri in sorted(kept)}
            return Finished(self._write_tables(answers), answers, read, vanished, starting)

    def _answers(self, places: Sequence[Place], options: Mapping[str, Any]) -> Iterator[tuple[Place, Answer]]:
        outages = 0
        work = partial(read_place, rows_of=self._rows_of, rows_of_failure=self._rows_of_failure)
        for done in run_tasks(work, places, **options):
            place, away = places[done.place], isinstance(done.error, StoreAwayError)
            reason = str(done.error) if away else done.reason
            yield place, done.result or Answer(self._rows_of_failure(place, reason))
            outages = outages + 1 if away else 0
            if outages == OUTAGES:
                raise StoreAwayError(
                    f'the store was given up after {OUTAGES} recordings in a row (what was done stands, and '
                    f'the same command goes on where it stopped): {done.error}'
                )

    @contextlib.contextmanager
    def _opened(self, order: Mapping[str, Any] | None) -> Iterator[TextIO]:
        """Make or resume the folder, for one process at a time, and give its journal."""
        folder, kept_order = self._folder, self._folder / ORDER
        if order is not None and folder.exists() and not kept_order.exists() and any(folder.iterdir()):
            raise OrderError(f'{folder} holds something else; choose another folder with --out')
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / '.lock').open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise OrderError(
                    f'{folder} is being written by another command: wait, or choose another --out'
                ) from None
            if order is not None:
                if not kept_order.exists():
                    _write(kept_order, json.dumps(order, indent=2, sort_keys=True) + '\n')
                _check_same(folder, json.loads(kept_order.read_text(encoding='utf-8')), order)
            journal = (folder / JOURNAL).open('a', encoding='utf-8')
            try:
                yield journal
            finally:
                with contextlib.suppress(OSError):  # of a line that could not be written, as was reported
                    journal.close()

    def _read_journal(self) -> dict[str, Answer]:
        """Read the journal up to the first line that is not whole, and cut off the rest."""
        file, sound, known = self._folder / JOURNAL, 0, {}
        with contextlib.suppress(ValueError), file.open(encoding='utf-8') as lines:
            if (header := lines.readline()) == self._header():
                sound = len(header.encode())
                for line in lines:
                    if not line.endswith('\n'):
                        break
                    uri, fingerprint, rows = json.loads(line)
                    known[uri] = Answer(rows, fingerprint)
                    sound += len(line.encode())
        os.truncate(file, sound)
        if not sound:
            with explained_errors(file), file.open('a', encoding='utf-8') as journal:
                journal.write(self._header())
        return known

    def _header(self) -> str:
        """Return the first line of the journal: rows of other columns are of another version."""
        return f'{json.dumps({table: [each.name for each in own] for table, own in self._columns.items()})}\n'

    def _write_tables(self, answers: Mapping[str, Answer]) -> 'dict[str, pyarrow.Table]':
        tables = {}
        for name, columns in self._columns.items():
            rows = [row for answer in answers.values() for row in answer.rows.get(name, ())]
            rows.sort(key=lambda row: (row[self._key], row['mount']))
            tables[name] = table_of(columns, rows)
            write_table(tables[name], self._folder / f'{name}.parquet')
        lines = [_line(uri, answer) for uri, answer in answers.items() if answer.fingerprint]
        _write(self._folder / JOURNAL, ''.join([self._header(), *lines]))
        return tables


def read_place(
    place: Place, rows_of: Callable[[Path, Place], Rows], rows_of_failure: Callable[[Place, str], Rows]
) -> Answer:
    """Return the rows of the recording at `place`, and what they took.

    Raises `StoreAwayError` where the store does not answer; what cannot be fetched for another reason is told
    by its rows.
    """
    begin = time.process_time()
    try:
        with local_copy(place.uri) as path:
            rows, fingerprint = rows_of(path, place), place.fingerprint
    except StoreAwayError:
        raise
    except OSError as error:
        rows, fingerprint = rows_of_failure(place, str(error)), ''
    return Answer(rows, fingerprint, time.process_time() - begin, f'{platform.node()}/{os.getpid()}')


def _check_same(folder: Path, before: Mapping[str, Any], order: Mapping[str, Any]) -> None:
    for name in sorted(before.keys() | order.keys()):
        if before.get(name) != order.get(name):
            raise OrderError(
                f'{folder} holds the result of another order: {name} was {json.dumps(before.get(name))}, now '
                f'it is {json.dumps(order.get(name))}; choose another folder with --out'
            )


def _line(uri: str, answer: Answer) -> str:
    return json.dumps([uri, answer.fingerprint, answer.rows]) + '\n'


def _write(file: Path, text: str) -> None:
    """Write a file whole or not at all; raises `WritingError`."""
    with replaced(file) as beside:
        beside.write_text(text, encoding='utf-8')
