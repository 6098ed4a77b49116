"""The signals of a simulated drive, from its recording: what sensor and control saw, and the truth."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.recordings.times import Times, each_once, is_in
from mount_models.sampling import SAMPLE_TIME
from mount_ros.topics import CONTROL_TRACE, DISPLACEMENT, SIM_TRUTH

FloatArray = NDArray[np.float64]

_SECOND = 1e9  # ns
_TRACED = ('damping_active', 'current', 'desired_force')
_OF_SOME = 'band_displacement'  # of some policies
_EXCITED = ('road_height',)  # by which an undamped run finds its place in the drive
_AT_THE_END = ('rest_gap', 'contact_gap')  # what the summary of a drive asks for, read in the same pass


@dataclass(frozen=True)
class Seen:
    """What sensor and control saw at each displacement sample; SI, arrays (n,).

    Where control made no step, damping is off, current and desired force are 0, and the band displacement is
    NaN; so it is of a policy without one.
    """

    time: FloatArray
    displacement: FloatArray
    damping_active: NDArray[np.bool_]
    current: FloatArray
    desired_force: FloatArray
    band_displacement: FloatArray


@dataclass(frozen=True)
class Truth:
    """Scalars of the topic `sim/truth` by their names; SI, arrays (m,)."""

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    coil_current: FloatArray
    current_setpoint: FloatArray
    friction_force: FloatArray
    mount_force: FloatArray
    chassis_acceleration: FloatArray

    def since(self, begin: float) -> 'Truth':
        """Return the samples from the time `begin` (s) on."""
        kept = self.time >= begin
        return Truth(**{field.name: getattr(self, field.name)[kept] for field in fields(self)})


_TRUE = tuple(field.name for field in fields(Truth) if field.name != 'time')
DRIVE_COLUMNS = {
    DISPLACEMENT.name: DISPLACEMENT.names,
    CONTROL_TRACE.name: (*_TRACED, _OF_SOME),
    SIM_TRUTH.name: (*_TRUE, *_EXCITED, *_AT_THE_END),
}
"""What is read of a drive, {topic: columns}."""


@dataclass(frozen=True)
class DriveSignals:
    """The signals of one drive; times are in s from the stamp `zero` (ns) on."""

    recording: Path
    zero: int
    seen: Seen
    truth: Truth
    sample_time: float = SAMPLE_TIME  # s


def load_drive(recording: Recording, excitation_start: float | None = None) -> DriveSignals:
    """Read the signals of a drive, with time from the zero of its time axis on.

    With `excitation_start` (s from the plant's first sample) time begins there. Raises `ReadingError` where
    a topic is missing.
    """
    recording.load_columns(DRIVE_COLUMNS)
    zero = recording.time_axis.zero
    if excitation_start is not None:
        zero = excitation_stamp(recording, excitation_start)
    truth = recording[SIM_TRUTH.name]
    stamps, order = _sorted(truth.stamps)
    return DriveSignals(
        recording=recording.path,
        zero=zero,
        seen=_seen(recording, zero),
        truth=Truth(((stamps - zero) * 1e-9), *(truth[name][order] for name in _TRUE)),
        sample_time=1.0 / recorded_sample_rate(recording),
    )


def excitation_stamp(recording: Recording, start: float) -> int:
    """Return the stamp (ns) at which the excitation began, `start` s after the plant's first sample."""
    return int(recording[SIM_TRUTH.name].stamps.min()) + round(start * _SECOND)


def _seen(recording: Recording, zero: int) -> Seen:
    displacement, trace = recording[DISPLACEMENT.name], recording[CONTROL_TRACE.name]
    stamps, order = _sorted(displacement.stamps)
    known, of_known = each_once(trace.stamps)
    # of samples that came twice the first
    places = np.flatnonzero(is_in(stamps, known) & (np.diff(stamps, prepend=stamps[:1] - 1) > 0))
    of_trace = np.searchsorted(known, stamps[places])
    traced = {}
    for name in (*_TRACED, _OF_SOME):
        values = np.full(len(stamps), np.nan)
        if name in trace.columns or name != _OF_SOME:
            values[places] = trace[name][of_known][of_trace]
        traced[name] = values
    return Seen(
        time=((stamps - zero) / _SECOND),
        displacement=displacement['mount'][order],
        damping_active=traced['damping_active'] > 0.0,
        current=np.nan_to_num(traced['current'], copy=False),
        desired_force=np.nan_to_num(traced['desired_force'], copy=False),
        band_displacement=traced['band_displacement'],
    )


def _sorted(stamps: Times) -> tuple[Times, slice | NDArray[np.intp]]:
    """Return stamps (ns) sorted, and their places; no copies where they rise."""
    if (stamps[1:] > stamps[:-1]).all():
        return stamps, slice(None)
    order = np.argsort(stamps)
    return stamps[order], order
