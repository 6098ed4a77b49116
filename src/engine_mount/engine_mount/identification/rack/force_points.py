"""Force of the actuator over gap and current, from files of every format and MCAP, for its calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.identification.rack.columns import (
    RackRecordingError,
    check_alive,
    read_columns,
)
from engine_mount.identification.rack.given import (
    FEWEST,
    GivenValues,
    checked_files,
    gap_of,
    is_table,
    topic_in,
)
from engine_mount.recordings.place import open_run
from engine_mount.signals.mapping import Mapping
from mount_ros.topics import COIL_RIPPLE

FloatArray = NDArray[np.float64]
FORCE_SIGNAL = 'sim/clamp_force:wrench.force.z'
_BINS = 100  # chosen: points from one recorded ramp


@dataclass(frozen=True)
class ForcePoints:
    """Measured points, rows of one length: gap (m), current (A), force (N)."""

    gap: FloatArray
    current: FloatArray
    force: FloatArray


def read_force(files: Sequence[Path], mapping: Mapping, given: GivenValues) -> ForcePoints:
    """Return the points of all files, each with a gap by column, by option or by its name.

    Raises `RackRecordingError` and the readers' errors.
    """
    parts = []
    for file in checked_files(files):
        if is_table(file):
            known = given.gap.get(file)
            needed = ('current', 'force') if known is not None else ('gap', 'current', 'force')
            columns = read_columns(file, mapping, needed)
            current, force = columns['current'], columns['force']
            gap = columns['gap'] if known is None else np.full(current.shape, known)
        else:
            gap, current, force = _force_from_bag(file, mapping, given)
        if force.size < FEWEST:
            raise RackRecordingError(
                f'{file} holds {force.size} points, at least {FEWEST} are needed; measure more currents'
            )
        check_alive(file, 'current', 'A', current, np.zeros(current.size))
        check_alive(file, 'force', 'N', force, current)
        parts.append((gap, current, force))
    return ForcePoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _force_from_bag(
    file: Path, mapping: Mapping, given: GivenValues
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return up to `_BINS` points of a recorded ramp: means over small steps of the current."""
    recording = open_run(file)
    ripple = topic_in(recording, COIL_RIPPLE.name)
    chosen = mapping.columns.get('force')
    topic, colon, signal = (chosen.column if chosen else FORCE_SIGNAL).partition(':')
    if not colon:
        raise RackRecordingError(
            f'--column force={topic}: of an MCAP recording write TOPIC:FIELD, as {FORCE_SIGNAL}'
        )
    force = topic_in(recording, topic)
    current, at, values = ripple['coil_current'], ripple.stamps, force[signal]
    known = np.isfinite(values)
    if known.sum() < FEWEST or not np.isfinite(current).any():
        raise RackRecordingError(
            f'{file}: {topic} and {COIL_RIPPLE.name} hold too few finite samples; record again'
        )
    matched = np.interp(at, force.stamps[known], values[known], left=np.nan, right=np.nan)
    both = np.isfinite(matched) & np.isfinite(current) & (current >= 0.0)
    if both.sum() < FEWEST:
        raise RackRecordingError(
            f'{file}: {topic} and {COIL_RIPPLE.name} have {int(both.sum())} samples of the same time, needed '
            f'are {FEWEST}; are they of one recording?'
        )
    current, matched = current[both], matched[both]
    places = np.minimum((current / current.max() * _BINS).astype(int), _BINS - 1)
    filled = np.unique(places)
    means = np.array([(current[places == k].mean(), matched[places == k].mean()) for k in filled])
    return np.full(filled.size, gap_of(file, given.gap)), means[:, 0], means[:, 1]
