"""A CSV file as a table."""

import csv
from pathlib import Path

from engine_mount.recordings.signals.signal import SignalError
from engine_mount.recordings.signals.table import Table


def read_csv(path: Path) -> Table:
    """Return the table in `path`; lines that begin with # are comments. Raises `SignalError`."""
    with path.open(newline='', encoding='utf-8-sig', errors='replace') as stream:
        reader = csv.reader(stream)
        numbered = [(reader.line_num, row) for row in reader if row and not row[0].startswith('#')]
    if len(numbered) < 2:
        raise SignalError(f'{path} holds {len(numbered)} lines; needed are a header and the samples')
    header = tuple(name.strip() for name in numbered[0][1])
    return Table(path, header, [line for line, _ in numbered[1:]], [row for _, row in numbered[1:]])
