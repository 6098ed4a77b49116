"""The folder of a result: rows in small files as they are done, one sorted table at the end.

    order.json      what was asked; another order is refused
    parts/*.parquet the rows of finished recordings, each file whole or not there
    result.parquet  all rows, sorted; there once the order is done

A file comes into being under another name and is renamed when it is whole, so that whatever ends a run leaves
finished recordings or none. A recording is finished when its rows are in a part, with the fingerprint that
its files have now; rows of what could not be fetched are in no part, so that the same command tries them
again.
"""

import contextlib
import fcntl
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.columns import TABLES, TEXT, Column, table_of, write_table, writing
from engine_mount.fleet.what_if.columns import REPLAY_COLUMNS
from engine_mount.signals.extras import required

if TYPE_CHECKING:
    import pyarrow

Row = Mapping[str, Any]

RESULT, ORDER, PARTS = 'result.parquet', 'order.json', 'parts'
_FINGERPRINT = 'fingerprint'
_OF_PARTS = (*REPLAY_COLUMNS, Column(_FINGERPRINT, TEXT, '', 'of the files, as in a catalogue'))
_SORTED_BY = [('recording', 'ascending'), ('mount', 'ascending')]


class ResultError(ValueError):
    """A folder cannot take the rows of an order; the text says why, and what would help."""


class Result:
    """The rows of one order in a folder; one process at a time writes there."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.table = folder / RESULT
        self._parts = folder / PARTS
        self._numbers = iter(range(0))

    @contextlib.contextmanager
    def taken(self, order: Mapping[str, Any]) -> Iterator[None]:
        """Make the folder or go on with it, for as long as the block lasts; raises `ResultError`."""
        if self.folder.exists() and not (self.folder / ORDER).exists() and any(self.folder.iterdir()):
            raise ResultError(f'{self.folder} holds something else; choose another folder with --out')
        self._parts.mkdir(parents=True, exist_ok=True)
        with (self.folder / f'.{ORDER}.lock').open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise ResultError(
                    f'{self.folder} is being written by another command; wait for it, or choose another --out'
                ) from None
            self._check(order)
            self._tidy()
            begin = max((int(part.stem) for part in self._parts.glob('*.parquet')), default=-1) + 1
            self._numbers = iter(range(begin, 1 << 62))
            yield

    def finished(self) -> set[tuple[str, str]]:
        """Return the recordings whose rows are here, with the fingerprints of their files."""
        return {(row['recording'], row[_FINGERPRINT]) for part in self._read() for row in part.to_pylist()}

    def add(self, rows: Iterable[Row]) -> None:
        """Write the rows of recordings, with fingerprints, as a new part, all rows of each of them in it.

        Raises `WritingError`.
        """
        write_table(table_of(_OF_PARTS, rows), self._parts / f'{next(self._numbers):06d}.parquet')

    def finish(self, asked: Mapping[str, str], others: Iterable[Row]) -> 'pyarrow.Table':
        """Write and return the table: rows of `asked` {recording: fingerprint} in the parts, and `others`.

        Raises `WritingError`.
        """
        parts = (row for part in self._read() for row in part.to_pylist())
        # a recording that was another one before has other rows there, of another fingerprint
        rows = [row for row in parts if asked.get(row['recording']) == row[_FINGERPRINT]]
        table = table_of(_OF_PARTS, [*rows, *others]).drop([_FINGERPRINT])
        table = table.sort_by(_SORTED_BY).combine_chunks()
        write_table(table, self.table)
        return table

    def _check(self, order: Mapping[str, Any]) -> None:
        place = self.folder / ORDER
        if not place.exists():
            beside = self.folder / f'.{ORDER}.{os.getpid()}'
            with writing(place):
                beside.write_text(json.dumps(order, indent=2, sort_keys=True) + '\n', encoding='utf-8')
                beside.replace(place)
            return
        before = json.loads(place.read_text(encoding='utf-8'))
        for name in sorted(before.keys() | order.keys()):
            if before.get(name) != order.get(name):
                raise ResultError(
                    f'{self.folder} holds the result of another order: {name} was '
                    f'{json.dumps(before.get(name))}, now it is {json.dumps(order.get(name))}; '
                    'choose another folder with --out'
                )

    def _tidy(self) -> None:
        """Remove what a run left that was ended while it wrote, or whose disk lost power."""
        arrow, parquet = required('pyarrow', TABLES), required('pyarrow.parquet', TABLES)
        for beside in self._parts.glob('.*'):
            beside.unlink()
        for part in self._parts.glob('*.parquet'):
            try:
                parquet.read_metadata(part)
            except (arrow.ArrowInvalid, OSError):
                part.unlink()

    def _read(self) -> Iterator['pyarrow.Table']:
        parquet = required('pyarrow.parquet', TABLES)
        for part in sorted(self._parts.glob('*.parquet')):
            yield parquet.read_table(part)
