"""Questions to the tables of a fleet, in SQL, answered by DuckDB from the Parquet files of a folder."""

import json
import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.columns import TABLES
from engine_mount.fleet.job import ORDER
from engine_mount.signals.extras import required

if TYPE_CHECKING:
    import duckdb
    import pyarrow
    import pyarrow.dataset

NAMES = ('recordings', 'events', 'result')
"""The tables that a folder can hold, each a file NAME.parquet."""

_MEMORY = '1GB'  # chosen: what a question may take, before it is refused
_TIME_LIMIT = 60.0  # s, chosen: what takes longer is refused
_ROW_LIMIT = 1_000_000  # chosen: of an answer, which stands in memory
_LOCKS = (
    'SET python_enable_replacements = false',  # no variable of this program is a table
    'SET enable_external_access = false',  # no other file, no network, no extension
    'SET allow_community_extensions = false',
    'SET lock_configuration = true',  # and no question undoes this
)


class QueryError(ValueError):
    """A question cannot be answered; the text says why, and what could be asked."""


def query(folder: str | os.PathLike[str], sql: str, time_limit: float = _TIME_LIMIT) -> 'pyarrow.Table':
    """Return the answer to one SELECT about the tables of a catalogue or result.

    Their columns and units: docs/reference/fleet_columns.md. Nothing can be written, and no other file be
    read. Raises `QueryError`, also for what takes longer than `time_limit` (s).
    """
    engine = required('duckdb', 'a question to a fleet')
    tables = tables_of(folder)
    connection = _locked(engine, tables)
    timer = threading.Timer(time_limit, connection.interrupt)
    timer.start()
    try:
        statements = connection.extract_statements(sql)
        if len(statements) != 1 or statements[0].type != engine.StatementType.SELECT:
            raise QueryError('a question is one SELECT statement; tables: ' + ', '.join(tables))
        rows: pyarrow.Table = connection.sql(sql).limit(_ROW_LIMIT + 1).to_arrow_table()
        if len(rows) > _ROW_LIMIT:
            raise QueryError(f'the answer has more than {_ROW_LIMIT} rows (limit): aggregate, or add LIMIT')
        return rows
    except engine.InterruptException:
        raise QueryError(
            f'no answer within {time_limit:g} s (limit): ask for less, or raise --time-limit'
        ) from None
    except engine.Error as error:
        raise QueryError(_sentence(str(error), sql, tables)) from None
    finally:
        timer.cancel()
        timer.join()
        connection.close()


def tables_of(folder: str | os.PathLike[str]) -> dict[str, 'pyarrow.dataset.Dataset']:
    """Return the tables in a folder by their names, opened but not read.

    Those of a result have the tables of the catalogue beside them that it was made of, if it was. Raises
    `QueryError`.
    """
    dataset = required('pyarrow.dataset', TABLES)
    if Path(folder).is_file():
        raise QueryError(f'{folder} is a file; name the folder that it is in, {Path(folder).parent}')
    there = _files(Path(folder))
    if not there and (Path(folder) / ORDER).is_file():
        raise QueryError(f'{folder} is not finished; the same engine-mount fleet replay goes on with it')
    if not there:
        raise QueryError(
            f'{folder} holds no table of a fleet ({", ".join(f"{name}.parquet" for name in NAMES)}); '
            'engine-mount fleet index or replay makes one'
        )
    for place in _asked_for(Path(folder)):
        there = _files(Path(place)) | there
    try:
        return {name: dataset.dataset(file, format='parquet') for name, file in there.items()}
    except (OSError, ValueError) as error:
        raise QueryError(f'{folder} cannot be read: {" ".join(str(error).split())}') from None


def result_of(folder: str | os.PathLike[str]) -> 'pyarrow.Table':
    """Return the table of a result, units and meanings with it; raises `QueryError`."""
    tables = tables_of(folder)
    if 'result' not in tables:
        raise QueryError(f'{folder} is a catalogue; engine-mount fleet replay makes a result of it')
    table: pyarrow.Table = tables['result'].to_table()
    return table


def _files(folder: Path) -> dict[str, Path]:
    """Return the tables that are in a folder, by their names."""
    files = {name: folder / f'{name}.parquet' for name in NAMES}
    return {name: file for name, file in files.items() if file.is_file()}


def _asked_for(folder: Path) -> list[str]:
    """Return the places that the result in a folder was made of, none where it holds no result."""
    order = folder / ORDER
    if not order.is_file():
        return []
    places: list[str] = json.loads(order.read_text(encoding='utf-8'))['asked_for']
    return places


def _locked(engine: Any, tables: dict[str, 'pyarrow.dataset.Dataset']) -> 'duckdb.DuckDBPyConnection':
    """Return a connection that knows the tables, and from then on nothing else.

    One thread, so that rows without ORDER BY come in the order of the file.
    """
    plain = {'threads': 1, 'memory_limit': _MEMORY, 'temp_directory': ''}
    closed = {'autoinstall_known_extensions': False, 'autoload_known_extensions': False}
    connection = engine.connect(':memory:', config={**plain, **closed})
    for name, table in tables.items():
        connection.register(name, table)
    for lock in _LOCKS:
        connection.execute(lock)
    return connection


def _sentence(reason: str, sql: str, tables: dict[str, 'pyarrow.dataset.Dataset']) -> str:
    """Return DuckDB's reason as one sentence, and what there is of the tables that the question names."""
    first = reason.split('\n')[0].rstrip(' !.')
    if 'file system operations are disabled' in reason or 'disabled through configuration' in reason:
        first = 'a question reads the tables of its folder and nothing else'
    there = [f'{name} has {", ".join(table.schema.names)}' for name, table in tables.items() if name in sql]
    if 'Table with name' in reason or not there:
        there = [f'tables: {", ".join(tables)}']
    return '; '.join([first, *there])
