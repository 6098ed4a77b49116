"""One recording of a fleet as signals: its setpoints as recorded and with the change."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_replay.given.taken import ReplayError
from mount_replay.replay import ReplayOrder, ReplayOutcome, replay_without_output
from mount_signals.sources.stores import local_copy

Column = NDArray[np.float64]


@dataclass(frozen=True)
class BeforeAndAfter:
    """Signals (n,) of the runs of the controller: time (s), displacement (m), setpoints (A)."""

    time: Column
    displacement: Column
    before: Column
    after: Column


def before_and_after(uri: str, changes: Mapping[str, Mapping[str, Any]], mount: str = '') -> BeforeAndAfter:
    """Return the signals of the recording at `uri`, replayed without and with {node: {parameter: value}}.

    Time counts from its first displacement sample. `mount` is which of several mounts. Raises a `ValueError`
    or `OSError` with the reason where it cannot be replayed.
    """
    with local_copy(uri) as path:
        before = replay_without_output(ReplayOrder(path, mount=mount))
        after = replay_without_output(ReplayOrder(path, changes=changes, mount=mount))
    runs = before.given.controls
    if not runs:
        raise ReplayError(f'{uri}: the controller had nothing to do')
    stamps = np.concatenate([run.stamps for run in runs])
    return BeforeAndAfter(
        (stamps - before.given.zero) * 1e-9,
        np.concatenate([run.displacement for run in runs]),
        _setpoints(before),
        _setpoints(after),
    )


def _setpoints(outcome: ReplayOutcome) -> Column:
    return np.concatenate([run.setpoints for run in outcome.replayed.runs])
