"""Many recordings: indexed, replayed with other parameters, asked."""

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow


def replay(
    places: Sequence[str],
    settings: Mapping[str, Any],
    out: str | os.PathLike[str],
    *,
    closed_loop: bool = False,
    scheduler: str = 'local',
    workers: int = 0,
) -> 'pyarrow.Table':
    """Return the table of `engine-mount fleet replay`: recordings as recorded and with other parameters.

    `places` are catalogues, URIs and paths, `settings` {parameter: value} as after `--set`, `out` the folder
    that holds the result and from which an interrupted call goes on. Raises a `ValueError` or `OSError` with
    the reason where the order is refused or cannot go on.
    """
    from pathlib import Path

    from mount_replay.fleet.what_if.run import FleetOrder, replay_fleet
    from mount_replay.replay import parsed_changes

    order = FleetOrder([str(place) for place in places], parsed_changes(settings), closed_loop)
    return replay_fleet(order, Path(out), scheduler=scheduler, workers=workers).table
