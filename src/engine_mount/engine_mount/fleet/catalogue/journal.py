"""What a catalogue that is being made knows so far, so that nothing that was read is read again."""

import contextlib
import json
from datetime import datetime
from pathlib import Path
from typing import Any

from engine_mount.fleet.catalogue.rows import Rows
from engine_mount.fleet.columns import writing

_NAME = '.unfinished.jsonl'
_TIMES = ('started',)


class Journal:
    """A line for each recording that was read, in a file of the catalogue's folder until that is written."""

    def __init__(self, folder: Path):
        self._file = folder / _NAME
        self.rows: dict[str, Rows] = {}
        """What was read before, by URI."""

    def __enter__(self) -> 'Journal':
        sound = 0
        with contextlib.suppress(FileNotFoundError), self._file.open('rb') as lines:
            for line in lines:
                try:
                    uri, recordings, events = json.loads(line)
                except ValueError:
                    break  # the end of a line that was being written
                self.rows[uri] = Rows([_read(row) for row in recordings], events)
                sound += len(line)
        with contextlib.suppress(FileNotFoundError), self._file.open('rb+') as file:
            file.truncate(sound)
        self._lines = self._file.open('a', encoding='utf-8')
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):  # of a line that `add` could not write, as it has said
            self._lines.close()

    def add(self, uri: str, rows: Rows) -> None:
        """Keep the rows of a recording; raises `WritingError`."""
        written = [[_plain(row) for row in rows.recordings], rows.events]
        with writing(self._file):
            self._lines.write(json.dumps([uri, *written]) + '\n')
            self._lines.flush()

    def finish(self) -> None:
        """Remove the file: the catalogue is written."""
        self._file.unlink()


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    return row | {name: row[name].isoformat() for name in _TIMES if row.get(name)}


def _read(row: dict[str, Any]) -> dict[str, Any]:
    return row | {name: datetime.fromisoformat(row[name]) for name in _TIMES if row.get(name)}
