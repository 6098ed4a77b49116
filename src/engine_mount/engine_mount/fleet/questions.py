"""Questions to the tables of a fleet, in SQL, answered by DuckDB from the Parquet files of a folder."""

import json
import os
import shlex
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from engine_mount.fleet.job import COLUMNS, JOURNAL, ORDER
from engine_mount.fleet.places import NEEDED_FOR
from engine_mount.signals.signal import required
from mount_models.quantity import nearest

if TYPE_CHECKING:
    import pyarrow
    import pyarrow.dataset

_MEMORY = '1GB'  # chosen: what a question may take, before it is refused
_TIME_LIMIT = 60.0  # s, chosen: what takes longer is refused
_ROW_LIMIT = 1_000_000  # chosen: of an answer, which stands in memory
_CONFIGURATION = {
    'threads': 1,  # rows without ORDER BY come in the order of the file
    'memory_limit': _MEMORY,
    'temp_directory': '',
    'autoinstall_known_extensions': False,
    'autoload_known_extensions': False,
}
_LOCKS = (
    'SET python_enable_replacements = false',  # no variable of this program is a table
    'SET enable_external_access = false',  # no other file, no network, no extension
    'SET allow_community_extensions = false',
    'SET lock_configuration = true',  # and no question undoes this
)


class QueryError(ValueError):
    """A question cannot be answered; the text says why, and what could be asked."""


class Worst(NamedTuple):
    """A row of a table, its place, and commands that open it."""

    row: Mapping[str, Any]
    uri: str
    commands: list[str]


def query(folder: str | os.PathLike[str], sql: str, time_limit: float = _TIME_LIMIT) -> 'pyarrow.Table':
    """Return the answer to one SELECT about the tables of a catalogue or result.

    Their columns and units: docs/reference/fleet_columns.md. Nothing can be written, and no other file be
    read. Raises `QueryError`, also for what takes longer than `time_limit` (s).
    """
    duckdb = required('duckdb', 'a question to a fleet')
    tables = tables_of(folder)
    connection = duckdb.connect(':memory:', config=_CONFIGURATION)
    for name, table in tables.items():
        connection.register(name, table)
    for lock in _LOCKS:
        connection.execute(lock)
    timer = threading.Timer(time_limit, connection.interrupt)
    timer.start()
    try:
        statements = connection.extract_statements(sql)
        if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
            raise QueryError('a question is one SELECT statement; tables: ' + ', '.join(tables))
        rows: pyarrow.Table = connection.sql(sql).limit(_ROW_LIMIT + 1).to_arrow_table()
        if len(rows) > _ROW_LIMIT:
            raise QueryError(f'the answer has more than {_ROW_LIMIT} rows (limit): aggregate, or add LIMIT')
        return rows
    except duckdb.InterruptException:
        raise QueryError(
            f'no answer within {time_limit:g} s (limit): ask for less, or raise --time-limit'
        ) from None
    except duckdb.Error as error:
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
    dataset, folder = required('pyarrow.dataset', NEEDED_FOR), Path(folder)
    if folder.is_file():
        raise QueryError(f'{folder} is a file; name the folder that it is in, {folder.parent}')
    there, order = _files(folder), folder / ORDER
    if not there:
        raise QueryError(
            f'{folder} holds no table of a fleet ({", ".join(f"{name}.parquet" for name in COLUMNS)}); '
            'engine-mount fleet index or replay makes one, or goes on where it stopped'
        )
    if order.is_file():
        for source in json.loads(order.read_text(encoding='utf-8'))['asked_for']:
            there = _files(Path(source)) | there
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


def worst(folder: str | os.PathLike[str], by: str, count: int = 10) -> list[Worst]:
    """Return the rows with the largest absolute values of column `by`, the largest first.

    Of a result, or where there is none of a catalogue. Rows without a number are left out; equal ones stand
    by the names of their recordings. Raises `QueryError`.
    """
    tables = tables_of(folder)
    name = 'result' if 'result' in tables else 'recordings'
    numbers = [field.name for field in tables[name].schema if str(field.type) in ('double', 'int64')]
    if by not in numbers:
        raise QueryError(f'{by!r} is no column of numbers of {name}; {nearest(by, numbers)}')
    order = f'abs("{by}") desc, recording, mount'
    sql = f'select * from {name} where "{by}" is not null order by {order} limit {count}'
    places = _places(Path(folder)) if name == 'result' else {}
    found = []
    for row in query(folder, sql).to_pylist():
        uri = row.get('uri') or places.get(row['recording'], row['recording'])
        found.append(Worst(row, uri, _commands(row, uri)))
    return found


def _commands(row: Mapping[str, Any], uri: str) -> list[str]:
    """Return the commands that open a recording: its page, and of a result the replay with the change."""
    place = shlex.quote(uri)
    changes = json.loads(row.get('changes') or '{}')
    if not changes or row['asked'] == 'displacement':
        return [f'engine-mount report {place}', f'engine-mount view {place}']
    mount = [f'--position {row["mount"]}'] if row['mount'] else []
    settings = [
        f'--set {shlex.quote(f"{node}.{name}={value if isinstance(value, str) else json.dumps(value)}")}'
        for node, values in changes.items()
        for name, value in values.items()
    ]
    return [f'engine-mount report {place}', ' '.join([f'engine-mount replay {place}', *mount, *settings])]


def _places(folder: Path) -> dict[str, str]:
    """Return {recording: URI} of the recordings of a result, by its journal."""
    with (folder / JOURNAL).open(encoding='utf-8') as lines:
        next(lines)  # the columns
        answers = [json.loads(line) for line in lines]
    return {row['recording']: uri for uri, _, rows in answers for row in rows['result']}


def _files(folder: Path) -> dict[str, Path]:
    """Return the tables that are in a folder, by their names."""
    files = {name: folder / f'{name}.parquet' for name in COLUMNS}
    return {name: file for name, file in files.items() if file.is_file()}


def _sentence(reason: str, sql: str, tables: Mapping[str, 'pyarrow.dataset.Dataset']) -> str:
    """Return DuckDB's reason as one sentence, and what there is of the tables that the question names."""
    first = reason.split('\n')[0].rstrip(' !.')
    if 'file system operations are disabled' in reason or 'disabled through configuration' in reason:
        first = 'a question reads the tables of its folder and nothing else'
    there = [f'{name} has {", ".join(table.schema.names)}' for name, table in tables.items() if name in sql]
    if 'Table with name' in reason or not there:
        there = [f'tables: {", ".join(tables)}']
    return '; '.join([first, *there])
