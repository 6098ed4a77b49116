"""Which recordings of a fleet to look at: those with the largest values in a column."""

import json
import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mount_replay.fleet.questions import QueryError, query, tables_of
from mount_replay.fleet.what_if.asked import AskedError, recordings_asked
from mount_replay.fleet.what_if.result import ORDER
from mount_signals.sources.source import SourceError

COUNT = 10
"""Rows, chosen."""


@dataclass(frozen=True)
class Worst:
    """A row of a table, and where its recording lies; `value` is that of the column asked for."""

    row: Mapping[str, Any]
    value: float
    uri: str

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
        found = [f'engine-mount report {place}']
        if self.changes and self.row.get('asked') != 'displacement':
            settings = [
                f'--set {shlex.quote(f"{node}.{name}={value_text(value)}")}'
                for node, values in self.changes.items()
                for name, value in values.items()
            ]
            found.append(' '.join(['engine-mount replay', place, *of_mount, *settings]))
        else:
            found.append(f'engine-mount view {place}')
        return found


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
    places = places_of(folder) if name == 'result' else {}
    return [
        Worst(row, float(row[by]), row.get('uri') or places.get(row['recording'], row['recording']))
        for row in rows
    ]


def places_of(folder: str | os.PathLike[str]) -> dict[str, str]:
    """Return {recording: URI} of the recordings of a result, looked up where its order found them.

    Raises `QueryError` where nothing of it is there any more.
    """
    order = json.loads((Path(folder) / ORDER).read_text(encoding='utf-8'))
    try:
        return {asked.recording: asked.uri for asked in recordings_asked(order['asked_for'])}
    except (AskedError, SourceError) as error:
        raise QueryError(
            f'where the recordings of {folder} lie is not known: {error}; what was moved is found by a '
            'link where it was'
        ) from None


def _check_column(schema: Any, table: str, by: str) -> None:
    numbers = [field.name for field in schema if str(field.type) in ('double', 'int64')]
    if by not in numbers:
        raise QueryError(f'{by!r} is no column of numbers of {table}; there are {", ".join(numbers)}')
