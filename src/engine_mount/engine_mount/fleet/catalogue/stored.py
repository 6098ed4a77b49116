"""A catalogue on the disk: a folder with a table of recordings and one of events."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.catalogue.columns import EVENTS, RECORDINGS
from engine_mount.fleet.catalogue.rows import Rows
from engine_mount.fleet.columns import TABLES, schema_of, table_of, write_table
from engine_mount.signals.extras import required

if TYPE_CHECKING:
    import pyarrow

RECORDINGS_FILE, EVENTS_FILE = 'recordings.parquet', 'events.parquet'


class CatalogueError(ValueError):
    """A folder is no catalogue; the text says what would make it one."""


def is_catalogue(folder: str | os.PathLike[str]) -> bool:
    """Return whether there is a catalogue in the folder."""
    return (Path(folder) / RECORDINGS_FILE).is_file()


def read_catalogue(folder: str | os.PathLike[str]) -> tuple['pyarrow.Table', 'pyarrow.Table']:
    """Return recordings and events of a catalogue, sorted by URI and mount; raises `CatalogueError`."""
    parquet = required('pyarrow.parquet', TABLES)
    files = [Path(folder) / name for name in (RECORDINGS_FILE, EVENTS_FILE)]
    if not all(file.is_file() for file in files):
        raise CatalogueError(f'{folder} holds no catalogue; engine-mount fleet index URI... --out makes one')
    return parquet.read_table(files[0]), parquet.read_table(files[1])


def read_rows(folder: Path) -> dict[str, Rows]:
    """Return the rows of a catalogue by URI; {} where there is none, or one with other columns."""
    if not is_catalogue(folder):
        return {}
    recordings, events = read_catalogue(folder)
    if not (recordings.schema.equals(schema_of(RECORDINGS)) and events.schema.equals(schema_of(EVENTS))):
        return {}
    found: dict[str, Rows] = {}
    for row in recordings.to_pylist():
        found.setdefault(row['uri'], Rows()).recordings.append(row)
    for row in events.to_pylist():
        if row['uri'] in found:
            found[row['uri']].events.append(row)
    return found


def write_catalogue(folder: Path, found: Mapping[str, Rows]) -> 'pyarrow.Table':
    """Write both tables, each whole or not at all, and return that of the recordings."""
    ordered = [found[uri] for uri in sorted(found)]
    events = [row for rows in ordered for row in sorted(rows.events, key=_mount)]
    recordings = [row for rows in ordered for row in sorted(rows.recordings, key=_mount)]
    write_table(table_of(EVENTS, events), folder / EVENTS_FILE)
    table = table_of(RECORDINGS, recordings)
    write_table(table, folder / RECORDINGS_FILE)
    return table


def _mount(row: Mapping[str, Any]) -> str:
    return str(row['mount'])
