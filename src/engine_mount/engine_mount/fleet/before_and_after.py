"""One recording of a fleet as signals: as recorded and with the change."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.inputs.consumed_samples import ReplayError
from engine_mount.drives.replay import Replay, replay
from engine_mount.fleet.foreign import NOTHING_SAID, Said, as_recording, mapped_in, own_recording
from engine_mount.fleet.what_if.closed_loop import both_motions
from engine_mount.fleet.what_if.compared import recorded_in
from engine_mount.recordings.place import open_mount
from engine_mount.signals.sources.stores import local_copy

Column = NDArray[np.float64]
Changes = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class BeforeAndAfter:
    """Signals (n,) over `time` (s); pairs are as recorded and with the change.

    `given` is what both controllers were given: the recorded displacement (m), to which they answered the
    `setpoints` (A). In a closed loop it is the recorded acceleration of the chassis (m/s^2), over which the
    mount moved by `displacements` (m), else None.
    """

    time: Column
    given: Column
    setpoints: tuple[Column, Column]
    displacements: tuple[Column, Column] | None = None


def before_and_after(
    uri: str, changes: Changes, mount: str = '', *, closed_loop: bool = False, said: Said = NOTHING_SAID
) -> BeforeAndAfter:
    """Return the signals of the recording at `uri` without and with {node: {parameter: value}}.

    Time counts from its first displacement sample, in a closed loop from the beginning of its acceleration.
    `mount` is which of several mounts, `said` what is said of files of others. Raises a `ValueError`
    or `OSError` with the reason where there are none.
    """
    with local_copy(uri) as copy, _as_recording(copy, said, closed_loop) as path:
        if closed_loop:
            first, other = both_motions(recorded_in(open_mount(path, mount)), changes)
            return BeforeAndAfter(
                first.time,
                first.acceleration,
                (first.setpoint, other.setpoint),
                (first.displacement, other.displacement),
            )
        before = replay(path, mount=mount)
        after = replay(path, changes, mount=mount)
    runs = before.given.controls
    if not runs:
        raise ReplayError(f'{uri}: the controller had nothing to do')
    stamps = np.concatenate([run.stamps for run in runs])
    return BeforeAndAfter(
        (stamps - before.given.zero) * 1e-9,
        np.concatenate([run.displacement for run in runs]),
        (_setpoints(before), _setpoints(after)),
    )


@contextlib.contextmanager
def _as_recording(path: Path, said: Said, closed_loop: bool) -> Iterator[Path]:
    if own_recording(path, said) is None:
        with as_recording(mapped_in(path, said), closed_loop=closed_loop) as made:
            yield made
    else:
        yield path


def _setpoints(outcome: Replay) -> Column:
    return np.concatenate([run.setpoints for run in outcome.replayed.runs])
