"""Many recordings: indexed, replayed with other parameters, asked.

What the three steps need is loaded when they are called.
"""

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow

    from engine_mount.fleet.foreign import Said

Place = str | os.PathLike[str]


def index(
    places: Sequence[Place],
    out: Place,
    *,
    mapping_files: Sequence[Place] = (),
    dbc: Place | None = None,
    scheduler: str = 'local',
    workers: int = 0,
) -> 'pyarrow.Table':
    """Return the table `recordings` of `engine-mount fleet index`: what each recording is and holds.

    `places` are folders, recordings and URIs, `out` the folder of the catalogue, which is brought up to date.
    Files of others are rows too where `mapping_files` say what their columns are (`dbc`: of CAN logs).
    Raises an `OSError` or `ValueError` with the reason where a place cannot be listed, what is said is not
    understood, or `out` not be written.
    """
    from engine_mount.fleet.catalogue.index import indexed

    said = _said(mapping_files, dbc)
    return indexed(places, out, said, scheduler=scheduler, workers=workers).recordings


def replay(
    places: Sequence[Place],
    settings: Mapping[str, Any],
    out: Place,
    *,
    closed_loop: bool = False,
    mapping_files: Sequence[Place] = (),
    dbc: Place | None = None,
    scheduler: str = 'local',
    workers: int = 0,
) -> 'pyarrow.Table':
    """Return the table of `engine-mount fleet replay`: recordings as recorded and with other parameters.

    `places` are catalogues, URIs and paths, `settings` {parameter: value} as after `--set`, `out` the folder
    that holds the result and from which an interrupted call goes on; `mapping_files` and `dbc` as for
    `index`. Raises a `ValueError` or `OSError` with
    the reason where the order is refused or cannot go on.
    """
    from pathlib import Path

    from engine_mount.drives.replay import parsed_changes
    from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet

    changes, said = parsed_changes(settings), _said(mapping_files, dbc)
    order = FleetOrder([os.fspath(place) for place in places], changes, closed_loop, said)
    return replay_fleet(order, Path(out), scheduler=scheduler, workers=workers).table


def _said(mapping_files: Sequence[Place], dbc: Place | None) -> 'Said':
    from pathlib import Path

    from engine_mount.fleet.foreign import said_in

    return said_in([Path(file) for file in mapping_files], None if dbc is None else Path(dbc))


def query(folder: Place, sql: str) -> 'pyarrow.Table':
    """Return the answer to one SELECT about a catalogue or result, as `engine-mount fleet query` does.

    Tables and columns: docs/reference/fleet_columns.md. Raises a `ValueError` with the reason.
    """
    from engine_mount.fleet.questions import query as answer_of

    return answer_of(folder, sql)
