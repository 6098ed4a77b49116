"""The tables of a fleet's folder, made recording by recording: each is read once, whatever ends a run.

journal.jsonl   a line for each recording that is done, with the fingerprint of its files
order.json      of a result: what was ordered; another order is refused
NAME.parquet    a table, written whole once the order is done
"""

import contextlib
import fcntl
import json
import os
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.columns import Column, replacing, table_of, write_table, writing
from engine_mount.fleet.runner import LOCAL, run_tasks
from engine_mount.signals.sources.source import StoreAwayError

if TYPE_CHECKING:
    import pyarrow

Row = dict[str, Any]

JOURNAL, ORDER = 'journal.jsonl', 'order.json'
OUTAGES = 4
"""Recordings in a row for which a store does not answer, after which a run ends; chosen."""


class OrderError(ValueError):
    """A folder cannot take the rows of an order; the text says why, and what would help."""


@dataclass(frozen=True)
class Answer:
    """The rows of one recording, {table: rows}, and what they took.

    `fingerprint` is that of its files, '' where a later run has to try again; `busy`: processor time in s;
    `worker`: the process.
    """

    rows: Mapping[str, Sequence[Row]]
    fingerprint: str
    failed: bool = False
    busy: float = 0.0
    worker: str = ''


@dataclass(frozen=True)
class Progress:
    """Recordings that are done of how many, those that failed, the rate (1/s) and the time left by it (s)."""

    done: int
    of: int
    failed: int = 0
    rate: float = 0.0

    @property
    def left(self) -> float:
        """Time left in s."""
        return (self.of - self.done) / self.rate if self.rate > 0.0 else float('inf')


class TableJob:
    """The tables {name: columns} of a folder, whose rows are sorted by the columns `sorted_by`."""

    def __init__(self, folder: Path, tables: Mapping[str, Sequence[Column]], sorted_by: Sequence[str]):
        self._folder, self._tables, self._sorted_by = folder, tables, sorted_by
        self.answers: dict[str, Answer] = {}
        """What is done, {URI of the recording: answer}."""

    @contextlib.contextmanager
    def opened(self, order: Mapping[str, Any] | None = None) -> Iterator[None]:
        """Make or resume the folder, for one process at a time; raises `OrderError` and `WritingError`."""
        if order is not None and not (self._folder / ORDER).exists() and _holds_anything(self._folder):
            raise OrderError(f'{self._folder} holds something else; choose another folder with --out')
        self._folder.mkdir(parents=True, exist_ok=True)
        with (self._folder / '.lock').open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise OrderError(
                    f'{self._folder} is being written by another command: wait, or choose another --out'
                ) from None
            if order is not None:
                self._check(order)
            self._read()
            self._journal = (self._folder / JOURNAL).open('a', encoding='utf-8')
            try:
                yield
            finally:
                with contextlib.suppress(OSError):  # of a line that could not be written, as was reported
                    self._journal.close()

    def left(self, places: Sequence[Place], mark: str = '') -> list[Place]:
        """Return the recordings that are new or have changed; `mark`: of the mappings of foreign files."""
        return [
            place
            for place in places
            if (known := self.answers.get(place.uri)) is None
            or known.fingerprint not in (place.fingerprint, place.fingerprint + mark)
        ]

    def run(
        self,
        places: Sequence[Place],
        answer: Callable[[Place], Answer],
        failure: Callable[[Place, str], Answer],
        progress: Callable[[Progress], None],
        *,
        of: int,
        scheduler: str = LOCAL,
        workers: int = 0,
        memory: int = 0,
    ) -> Iterator[Answer]:
        """Yield the answer of each place as it is done and kept; `failure` makes one of a reason.

        The other parameters are those of `run_tasks`; `of` is the number of all recordings, done ones
        included. Raises `StoreAwayError` after `OUTAGES` recordings in a row whose store does not answer.
        """
        begin, outages, failed = time.monotonic(), 0, 0
        progress(Progress(of - len(places), of))
        tasks = run_tasks(answer, places, scheduler=scheduler, workers=workers, memory=memory)
        for count, done in enumerate(tasks, 1):
            place, away = places[done.place], isinstance(done.error, StoreAwayError)
            given = done.result or failure(place, str(done.error) if away else done.reason)
            self._keep(place.uri, given)
            outages = outages + 1 if away else 0
            if outages == OUTAGES:
                raise StoreAwayError(
                    f'the store was given up after {OUTAGES} recordings in a row (what was done stands, and '
                    f'the same command goes on where it stopped): {done.error}'
                )
            failed += given.failed
            yield given
            rate = count / max(time.monotonic() - begin, 1e-9)
            progress(Progress(of - len(places) + count, of, failed, rate))

    def finish(self, uris: Collection[str]) -> dict[str, 'pyarrow.Table']:
        """Write and return the tables of the recordings `uris`; the others are forgotten."""
        self.answers = {uri: self.answers[uri] for uri in sorted(uris)}
        tables = {}
        for name, columns in reversed([*self._tables.items()]):
            rows = [row for answer in self.answers.values() for row in answer.rows.get(name, ())]
            rows.sort(key=lambda row: tuple(row[column] for column in self._sorted_by))
            tables[name] = table_of(columns, rows)
            write_table(tables[name], self._folder / f'{name}.parquet')
        lines = [
            self._header(),
            *(_line(uri, answer) for uri, answer in self.answers.items() if answer.fingerprint),
        ]
        _write(self._folder / JOURNAL, ''.join(lines))
        return tables

    def _keep(self, uri: str, answer: Answer) -> None:
        self.answers[uri] = answer
        if answer.fingerprint:
            with writing(self._folder / JOURNAL):
                self._journal.write(_line(uri, answer))
                self._journal.flush()

    def _header(self) -> str:
        """Return the first line of the journal: rows of other columns are of another version."""
        return (
            json.dumps({name: [column.name for column in columns] for name, columns in self._tables.items()})
            + '\n'
        )

    def _read(self) -> None:
        """Read the journal up to the first line that is not whole, and cut off the rest."""
        file, sound = self._folder / JOURNAL, 0
        with contextlib.suppress(FileNotFoundError, ValueError), file.open(encoding='utf-8') as lines:
            header = lines.readline()
            if header == self._header():
                sound = len(header.encode())
                for line in lines:
                    if not line.endswith('\n'):
                        break
                    uri, fingerprint, rows = json.loads(line)
                    self.answers[uri] = Answer(rows, fingerprint)
                    sound += len(line.encode())
        if sound:
            os.truncate(file, sound)
        else:
            _write(file, self._header())

    def _check(self, order: Mapping[str, Any]) -> None:
        place = self._folder / ORDER
        if not place.exists():
            _write(place, json.dumps(order, indent=2, sort_keys=True) + '\n')
        before = json.loads(place.read_text(encoding='utf-8'))
        for name in sorted(before.keys() | order.keys()):
            if before.get(name) != order.get(name):
                raise OrderError(
                    f'{self._folder} holds the result of another order: {name} was '
                    f'{json.dumps(before.get(name))}, now it is {json.dumps(order.get(name))}; '
                    'choose another folder with --out'
                )


def _line(uri: str, answer: Answer) -> str:
    return json.dumps([uri, answer.fingerprint, answer.rows], default=datetime.isoformat) + '\n'


def _write(file: Path, text: str) -> None:
    """Write a file whole or not at all; raises `WritingError`."""
    with replacing(file) as beside:
        beside.write_text(text, encoding='utf-8')


def _holds_anything(folder: Path) -> bool:
    return folder.exists() and any(folder.iterdir())
