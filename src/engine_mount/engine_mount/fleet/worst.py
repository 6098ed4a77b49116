"""Which recordings of a fleet to look at: those with the largest values in a column."""

import difflib
import json
import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from engine_mount.fleet.catalogue.columns import FOREIGN
from engine_mount.fleet.foreign import Said, said_in
from engine_mount.fleet.job import ORDER
from engine_mount.fleet.questions import QueryError, query, tables_of
from engine_mount.fleet.what_if.asked import AskedError, recordings_asked
from engine_mount.fleet.what_if.columns import DISPLACEMENT
from engine_mount.signals.sources.source import SourceError

COUNT = 10
"""Rows, chosen."""


@dataclass(frozen=True)
class Worst:
    """A row of a table, and where its recording lies; `value` is that of the column asked for."""

    row: Mapping[str, Any]
    value: float
    uri: str
    dbc: str = ''  # of CAN logs of others

    @property
    def changes(self) -> dict[str, dict[str, Any]]:
        """What a result has other than recorded, {node: {parameter: value}}."""
        found: dict[str, dict[str, Any]] = json.loads(self.row.get('changes') or '{}')
        return found

    @property
    def commands(self) -> list[str]:
        """The commands that open it: its page, and of a result the replay with the change."""
        place, mount = shlex.quote(self.uri), self.row.get('mount')
        of_mount = ['--mount', mount] if mount else []
        settings = [
            f'--set {shlex.quote(f"{node}.{name}={value_text(value)}")}'
            for node, values in self.changes.items()
            for name, value in values.items()
        ]
        if self.row.get('mapped') or self.row.get('kind') == FOREIGN:
            return self._commands_of_others(place, settings)
        found = [f'engine-mount report {place}']
        if self.changes and self.row.get('asked') != DISPLACEMENT:
            found.append(' '.join(['engine-mount replay', place, *of_mount, *settings]))
        else:
            found.append(f'engine-mount view {place}')
        return found

    def _commands_of_others(self, place: str, settings: list[str]) -> list[str]:
        """Return the commands that tell the columns of a file of others, and take it as the row did."""
        dbc = [f'--dbc {shlex.quote(self.dbc)}'] if self.dbc else []
        found = [' '.join(['engine-mount info', place, *dbc])]
        columns: dict[str, str] = json.loads(self.row.get('mapped') or '{}')
        file = self.row.get('mapping_file')
        said = [*([f'--map-file {shlex.quote(file)}'] if file else []), *dbc]
        if self.row.get('asked') == DISPLACEMENT:
            named = [] if file else [f'--column {shlex.quote(columns["acceleration"])}']
            command = ['engine-mount drive --core --scenario recorded --file', place]
        elif any(name.endswith('displacement') for name in columns):
            motion = {name: column for name, column in columns.items() if name.endswith('displacement')}
            named = [] if file else [f'--map {shlex.quote(f"{one}={motion[one]}")}' for one in motion]
            command = ['engine-mount replay', place]
        else:
            return found
        return [*found, ' '.join([*command, *named, *said, *settings])]


def value_text(value: Any) -> str:
    """Return a value of a parameter as `--set` takes it."""
    return value if isinstance(value, str) else json.dumps(value)


def worst(
    folder: str | os.PathLike[str], by: str, count: int = COUNT, *, lowest: bool = False
) -> list[Worst]:
    """Return the rows with the largest absolute values of column `by`, the largest first.

    Of a result, or where there is none of a catalogue. `lowest`: those with the smallest values instead.
    Rows without a number are left out; equal ones stand by the names of their recordings. Raises
    `QueryError`.
    """
    tables = tables_of(folder)
    name = 'result' if 'result' in tables else 'recordings'
    _check_column(tables[name].schema, name, by)
    order = f'"{by}"' if lowest else f'abs("{by}") desc'
    rows = query(
        folder,
        f'select * from {name} where "{by}" is not null and not isnan("{by}"::double) '
        f'order by {order}, recording, mount limit {int(count)}',
    ).to_pylist()
    if name != 'result':
        return [Worst(row, float(row[by]), row['uri']) for row in rows]
    places, dbc = places_of(folder), _of_others(folder).get('dbc') or ''
    return [Worst(row, float(row[by]), places.get(row['recording'], row['recording']), dbc) for row in rows]


def places_of(folder: str | os.PathLike[str]) -> dict[str, str]:
    """Return {recording: URI} of the recordings of a result, looked up where its order found them.

    Raises `QueryError` where nothing of it is there any more.
    """
    others = bool(_of_others(folder).get('mapping_files'))
    try:
        found = recordings_asked(_order_of(folder)['asked_for'], others=others)
    except (AskedError, SourceError) as error:
        raise QueryError(
            f'where the recordings of {folder} lie is not known: {error}; what was moved is found by a '
            'link where it was'
        ) from None
    return {asked.recording: asked.uri for asked in found}


def said_of(folder: str | os.PathLike[str]) -> Said:
    """Return what the order of a result says of files of others, from the files that it names.

    Raises a `ValueError` or `OSError` where one is not there any more.
    """
    told = _of_others(folder)
    dbc = told.get('dbc')
    return said_in([Path(file) for file in told.get('mapping_files', ())], Path(dbc) if dbc else None)


def _of_others(folder: str | os.PathLike[str]) -> dict[str, Any]:
    told: dict[str, Any] = _order_of(folder).get('of_others', {})
    return told


def _order_of(folder: str | os.PathLike[str]) -> dict[str, Any]:
    order: dict[str, Any] = json.loads((Path(folder) / ORDER).read_text(encoding='utf-8'))
    return order


def _check_column(schema: Any, table: str, by: str) -> None:
    numbers = [field.name for field in schema if str(field.type) in ('double', 'int64')]
    if by not in numbers:
        near = difflib.get_close_matches(by, numbers, n=3)
        hint = f'did you mean {" or ".join(near)}?' if near else f'there are {", ".join(numbers)}'
        raise QueryError(f'{by!r} is no column of numbers of {table}; {hint}')
