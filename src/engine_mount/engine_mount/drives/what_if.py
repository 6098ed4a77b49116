"""What another controller would have answered, for scripts and notebooks: a replay that writes nothing."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from engine_mount.drives.replay import ReplayOrder, ReplayOutcome, parsed_changes, replay_without_output


def what_if(
    recording: str | os.PathLike[str], settings: Mapping[str, Any] | None = None, *, mount: str = ''
) -> ReplayOutcome:
    """Return the replay of a recording or run in core, with {parameter: value} in place of those recorded.

    A name without its node is one of mount_control, as after `--set` of `engine-mount replay`. `mount` is
    which of several mounts is replayed. Raises a `ValueError` with the reason where a value is refused or
    the recording cannot be replayed.
    """
    changes = parsed_changes(settings or {})
    return replay_without_output(ReplayOrder(Path(recording), changes=changes, mount=mount))
