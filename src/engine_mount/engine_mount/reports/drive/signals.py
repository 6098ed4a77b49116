"""A simulated drive from its recording: what sensor and control saw, the truth, how friction followed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.events import Switching, switching_times
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.recordings.times import Times, each_once, is_in
from mount_control import band_pass
from mount_control.delay import LOOP_DELAY, delay_at
from mount_control.policy import continuous_viscous, switched_viscous
from mount_control.policy.contract import Policy
from mount_models.damper import damper_curve
from mount_models.sampling import SAMPLE_TIME
from mount_ros.topics import CONTROL_TRACE, DISPLACEMENT, SIM_TRUTH

FloatArray = NDArray[np.float64]

_SECOND = 1e9  # ns
_TRACED = ('damping_active', 'current', 'desired_force')
_OF_SOME = 'band_displacement'  # of some policies
_EXCITED = ('road_height',)  # by which an undamped run finds its place in the drive
_MEASURED = ('displacement', 'coil_ripple', 'sim/truth', 'sim/chassis_acceleration', 'sim/mount_force')
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


def acts_after(sample_time: float) -> float:
    """Return the time (s) from a sample to the middle of the effect of its setpoint."""
    return delay_at(LOOP_DELAY, sample_time)


def samples_at_the_ends(recording: Recording, topics: Mapping[str, TopicAudit], taken: int) -> list[str]:
    """Return a sentence per topic with measurements that begins too late or ends too early.

    Of these the stamps show nothing (`topics`: the audit); `taken` is the electronics' own count.
    """
    found = []
    for name in _MEASURED:
        missing = taken - (topics[recording.resolve(name)].expected or 0)
        if missing > 0:
            found.append(
                f'{name}: {missing} of {taken} samples that the electronics took are missing before the '
                'first or behind the last recorded one'
            )
    return found


def levels_of(policy: Policy, parameters: Any) -> dict[str, float]:
    """Return the displacements (m) at which a policy changes something, drawn as lines; {} where unknown."""
    if policy is switched_viscous:
        on, off = parameters.switch_on_level, parameters.switch_off_level
        return {'switch-on level': on, 'switch-off level': off}
    if policy is continuous_viscous:
        return {'damping half engaged': parameters.half_amplitude}
    return {}


def switching(seen: Seen) -> Switching:
    """Return the times at which damping was switched."""
    return Switching(*(tuple(each.tolist()) for each in switching_times(seen.time, seen.damping_active)))


def tracking_error(drive: DriveSignals, policy: Policy, parameters: Any) -> float:
    """Return the rms error of the friction force while damping is on, as a share of the peak wanted force.

    NaN if damping was never on.
    """
    wanted, places = wanted_force(drive, policy, parameters)
    on = places[drive.seen.damping_active]
    if len(on) == 0 or not wanted[on].any():
        return math.nan
    error = drive.truth.friction_force[on] - wanted[on]
    return float(np.sqrt(np.mean(error**2)) / np.max(np.abs(wanted[on])))


def error_text(share: float) -> str:
    """Return a `tracking_error` in words, and beside it what it does not prove."""
    return f'{100.0 * share:.1f} % rms of the peak wanted force; model and plant share the friction law'


def wanted_force(drive: DriveSignals, policy: Policy, parameters: Any) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the wanted friction force (N) at the true times, and which of them belongs to each sample.

    Of `switched_viscous` it is the force of the characteristic at the true velocity of the mount at that
    moment; so an error against it holds phase and delay as well as force. Of another policy it is the force
    that it asked for, at the time at which its setpoint acts, so an error holds no error of prediction.
    """
    if policy is switched_viscous:
        wanted = force_of_damper(parameters, drive.truth.velocity, drive.sample_time)
    else:
        wanted = np.interp(
            drive.truth.time, drive.seen.time + acts_after(drive.sample_time), drive.seen.desired_force
        )
    places = np.clip(
        np.searchsorted(drive.truth.time, drive.seen.time - 0.5 * drive.sample_time), 0, len(wanted) - 1
    )
    return wanted, places


def force_of_damper(
    parameters: switched_viscous.Parameters, velocity: FloatArray, sample_time: float
) -> FloatArray:
    """Return the force (N) of the characteristic at the true velocity (m/s, (n,)) in the band, undelayed."""
    from scipy.signal import lfilter  # loads long

    band = band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, sample_time)
    banded = lfilter([band.gain, 0.0, -band.gain], [1.0, band.a1, band.a2], velocity)
    return damper_curve(parameters.damper).force(banded)
