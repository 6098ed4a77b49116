"""A JSON file `{"data": [[number, ...], ...]}` as a table."""

import json
from pathlib import Path

from engine_mount.recordings.signals.signal import SignalError
from engine_mount.recordings.signals.table import Table


def read_json(path: Path) -> Table:
    """Return the rows in `path`, the columns named by their numbers from 0 on. Raises `SignalError`."""
    try:
        rows = json.loads(path.read_text(encoding='utf-8'))['data']
        widths = {len(row) for row in rows}
    except (ValueError, KeyError, TypeError) as error:
        raise SignalError(
            f'{path} is no table ({error!r}); expected is {{"data": [[number, ...], ...]}}'
        ) from None
    if len(widths) != 1:
        raise SignalError(
            f'{path}: its {len(rows)} rows hold {", ".join(map(str, sorted(widths))) or "no"} numbers; all '
            'must hold the same'
        )
    return Table(path, tuple(map(str, range(widths.pop()))), range(1, len(rows) + 1), rows)
