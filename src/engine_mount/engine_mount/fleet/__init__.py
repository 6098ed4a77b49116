"""Many recordings: indexed, replayed with other parameters, asked and reported."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow

_Place = str | os.PathLike[str]


class Fleet:
    """Recordings at and below `places` (folders, recordings, URIs), with their catalogue in the folder `out`.

    Each method returns a pyarrow table; its columns: docs/reference/fleet_columns.md. The work is done by
    `workers` processes (0: one on each core), or by the Dask cluster at the address `scheduler`. An
    interrupted call goes on where it stopped. Raises a `ValueError` or `OSError` with the reason.
    """

    def __init__(
        self, places: Sequence[_Place], out: _Place, *, scheduler: str = 'local', workers: int = 0
    ) -> None:
        self.places, self.catalogue = places, Path(out)
        self.result: Path | None = None
        """The folder of the last `replay`."""
        self._options: dict[str, Any] = {'scheduler': scheduler, 'workers': workers}

    def index(self) -> 'pyarrow.Table':
        """Return the table `recordings` of the catalogue: what each recording is and holds."""
        from engine_mount.fleet.catalogue import index

        return index(self.places, self.catalogue, **self._options).recordings

    def replay(
        self, changes: Mapping[str, Any], out: _Place, *, closed_loop: bool = False
    ) -> 'pyarrow.Table':
        """Return the table `result` in the folder `out`: the catalogue as recorded and with `changes`.

        These are {parameter: value} as after `--set`. With `closed_loop` the displacement is simulated anew.
        """
        from engine_mount.drives.replay import parsed_changes
        from engine_mount.fleet.replay import replay_fleet

        if not self.catalogue.exists():
            self.index()
        changed, self.result = parsed_changes(changes), Path(out)
        return replay_fleet([str(self.catalogue)], changed, self.result, closed_loop, **self._options).table

    def query(self, sql: str) -> 'pyarrow.Table':
        """Return the answer to one SELECT about the catalogue, and about the result of the last `replay`."""
        from engine_mount.fleet.questions import query

        return query(self.result or self.catalogue, sql)

    def report(self, by: str = '', count: int = 10) -> 'pyarrow.Table':
        """Write report.html beside the last result; return its worst `count` rows by the column `by`."""
        from engine_mount.fleet.job import COLUMNS, table_of
        from engine_mount.fleet.page import write_page

        _, looks = write_page(self.result or self.catalogue, None, by, count)
        return table_of(COLUMNS['result'], [look.row for look in looks])
