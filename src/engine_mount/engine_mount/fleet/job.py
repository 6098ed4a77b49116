"""The tables of a fleet's folder, made recording by recording: each is read once, whatever ends a run.

journal.jsonl   a line for each recording that is done, with the fingerprint of its files
order.json      of a result: what was ordered; another order is refused
NAME.parquet    a table, its columns declared in columns.yaml, written whole once the order is done
"""

import contextlib
import fcntl
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO

import yaml

from engine_mount.fleet.places import NEEDED_FOR, Place
from engine_mount.fleet.runner import run_tasks
from engine_mount.signals.signal import required
from engine_mount.signals.sources.stores import local_copy
from engine_mount.signals.sources.uris import StoreAwayError

if TYPE_CHECKING:
    import pyarrow

Row = dict[str, Any]
Rows = Mapping[str, Sequence[Row]]
"""{table: rows}."""

JOURNAL, ORDER = 'journal.jsonl', 'order.json'
OUTAGES = 4
"""Recordings in a row for which a store does not answer, after which a run ends; chosen."""


class OrderError(ValueError):
    """A folder cannot take the rows of an order; the text says why, and what would help."""


class WritingError(OSError):
    """A folder of a fleet cannot be written; the text says why, and what would help."""


class Column(NamedTuple):
    """One column: its name, its type as pyarrow names it, its unit ('': none), and a sentence about it."""

    name: str
    type: str
    unit: str
    meaning: str


_DECLARED = Path(__file__).with_name('columns.yaml').read_text(encoding='utf-8')
COLUMNS = {
    table: tuple(Column(name, *declared) for name, declared in columns.items())
    for table, columns in yaml.safe_load(_DECLARED).items()
}
"""{table: its columns} of `recordings`, `events` and `result`."""


class Answer(NamedTuple):
    """The rows of one recording, and the fingerprint of its files, '' where a later run has to try again."""

    rows: Rows
    fingerprint: str = ''


class Finished(NamedTuple):
    """The tables of a folder by their names, the answers of which they are made, and those of this run."""

    tables: 'dict[str, pyarrow.Table]'
    answers: list[Answer]
    read: list[Answer]


class TableJob(NamedTuple):
    """The `tables` of a folder, made of `rows_of(path, place)` of each recording, sorted by `key` and mount.

    `rows_of_failure(place, reason)` are the rows of one that could not be read; a later run tries it again.
    """

    folder: Path
    tables: Sequence[str]
    key: str
    rows_of: Callable[[Path, Place], Rows]
    rows_of_failure: Callable[[Place, str], Rows]

    def run(
        self,
        places: Sequence[Place],
        progress: Callable[[int, int], None],
        order: Mapping[str, Any] | None = None,
        **options: Any,
    ) -> Finished:
        """Read the recordings that are new or have changed; write and return the tables of all.

        A recording that is not among `places` is forgotten; `progress` takes how many are done of how many.
        `options` are those of `run_tasks`. Raises `OrderError`, `WritingError`, `SchedulerLostError`, and
        `StoreAwayError` after `OUTAGES` recordings in a row whose store does not answer; what was done until
        then stands.
        """
        with self._opened(order) as journal:
            known, marks = self._read_journal(), {place.uri: place.fingerprint for place in places}
            unchanged = {
                uri: known[uri] for uri in known.keys() & marks if known[uri].fingerprint == marks[uri]
            }
            answers, read = dict(unchanged), []
            progress(len(answers), len(places))
            left = [place for place in places if place.uri not in unchanged]
            for place, answer in self._answers(left, options):
                answers[place.uri] = answer
                read.append(answer)
                if answer.fingerprint:
                    with explained_errors(self.folder / JOURNAL):
                        journal.write(_line(place.uri, answer))
                        journal.flush()
                progress(len(answers), len(places))
            answers = dict(sorted(answers.items()))
            return Finished(self._write_tables(answers), list(answers.values()), read)

    def _answers(self, places: Sequence[Place], options: Mapping[str, Any]) -> Iterator[tuple[Place, Answer]]:
        outages = 0
        work = partial(read_place, rows_of=self.rows_of, rows_of_failure=self.rows_of_failure)
        for done in run_tasks(work, places, **options):
            place, away = places[done.place], isinstance(done.error, StoreAwayError)
            reason = str(done.error) if away else done.reason
            yield place, done.result or Answer(self.rows_of_failure(place, reason))
            outages = outages + 1 if away else 0
            if outages == OUTAGES:
                raise StoreAwayError(
                    f'the store was given up after {OUTAGES} recordings in a row (what was done stands, and '
                    f'the same command goes on where it stopped): {done.error}'
                )

    @contextlib.contextmanager
    def _opened(self, order: Mapping[str, Any] | None) -> Iterator[TextIO]:
        """Make or resume the folder, for one process at a time, and give its journal."""
        folder, kept_order = self.folder, self.folder / ORDER
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
                before = json.loads(kept_order.read_text(encoding='utf-8'))
                for name in sorted(before.keys() | order.keys()):
                    if before.get(name) != order.get(name):
                        raise OrderError(
                            f'{folder} holds the result of another order: {name} was '
                            f'{json.dumps(before.get(name))}, now it is {json.dumps(order.get(name))}; '
                            'choose another folder with --out'
                        )
            journal = (folder / JOURNAL).open('a', encoding='utf-8')
            try:
                yield journal
            finally:
                with contextlib.suppress(OSError):  # of a line that could not be written, as was reported
                    journal.close()

    def _read_journal(self) -> dict[str, Answer]:
        """Read the journal up to the first line that is not whole, and cut off the rest."""
        file, sound, known = self.folder / JOURNAL, 0, {}
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
        columns = {table: [each.name for each in COLUMNS[table]] for table in self.tables}
        return f'{json.dumps(columns)}\n'

    def _write_tables(self, answers: Mapping[str, Answer]) -> 'dict[str, pyarrow.Table]':
        tables = {}
        for name in self.tables:
            rows = [row for answer in answers.values() for row in answer.rows.get(name, ())]
            rows.sort(key=lambda row: (row[self.key], row['mount']))
            tables[name] = table_of(COLUMNS[name], rows)
            write_table(tables[name], self.folder / f'{name}.parquet')
        lines = [_line(uri, answer) for uri, answer in answers.items() if answer.fingerprint]
        _write(self.folder / JOURNAL, ''.join([self._header(), *lines]))
        return tables


def read_place(
    place: Place, rows_of: Callable[[Path, Place], Rows], rows_of_failure: Callable[[Place, str], Rows]
) -> Answer:
    """Return the rows of the recording at `place`.

    Raises `StoreAwayError` where the store does not answer; what cannot be fetched for another reason is told
    by its rows.
    """
    try:
        with local_copy(place.uri) as path:
            return Answer(rows_of(path, place), place.fingerprint)
    except StoreAwayError:
        raise
    except OSError as error:
        return Answer(rows_of_failure(place, str(error)))


def _line(uri: str, answer: Answer) -> str:
    return json.dumps([uri, answer.fingerprint, answer.rows]) + '\n'


def _write(file: Path, text: str) -> None:
    """Write a file whole or not at all; raises `WritingError`."""
    with replaced(file) as beside:
        beside.write_text(text, encoding='utf-8')


def schema_of(columns: Sequence[Column]) -> 'pyarrow.Schema':
    """Return the schema of a table; unit and meaning are metadata of its fields."""
    pyarrow = required('pyarrow', NEEDED_FOR)
    return pyarrow.schema(
        pyarrow.field(name, pyarrow.type_for_alias(kind), metadata={'unit': unit, 'meaning': meaning})
        for name, kind, unit, meaning in columns
    )


def table_of(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> 'pyarrow.Table':
    """Return rows, {column: value}, as a table; a value that a row lacks, and NaN, is null.

    Times are ISO texts in rows. Raises `ValueError` for a name that is no column.
    """
    pyarrow = required('pyarrow', NEEDED_FOR)
    rows, schema = list(rows), schema_of(columns)
    if unknown := {name for row in rows for name in row} - set(schema.names):
        raise ValueError(
            f'{", ".join(sorted(unknown))}: no such column; there are {", ".join(sorted(schema.names))}'
        )
    arrays = [
        pyarrow.array([row.get(field.name) for row in rows], from_pandas=True).cast(field.type)  # NaN: null
        for field in schema
    ]
    return pyarrow.table(arrays, schema=schema)


def write_table(table: 'pyarrow.Table', file: Path) -> None:
    """Write a table as Parquet, whole or not at all; the same table gives the same bytes.

    Raises `WritingError`.
    """
    parquet = required('pyarrow.parquet', NEEDED_FOR)
    with replaced(file) as beside:
        parquet.write_table(table, beside, compression='zstd')


@contextlib.contextmanager
def replaced(file: Path) -> Iterator[Path]:
    """Give the place of a new file that takes the place of `file` when the block ends, whole or not at all.

    Raises `WritingError`.
    """
    beside = file.with_name(f'.{file.name}.{os.getpid()}')
    with explained_errors(file):
        try:
            yield beside
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)


@contextlib.contextmanager
def explained_errors(file: Path) -> Iterator[None]:
    """Raise a `WritingError` where `file` cannot be written in the block, as on a full disk."""
    try:
        yield
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise WritingError(
            f'{file} cannot be written: {why}; what was written stands, and once that is mended the same '
            'command goes on where it stopped'
        ) from error
