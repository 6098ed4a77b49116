"""How well friction followed what was wanted in a drive, when damping was on, and what its ends lack."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.events import Switching, switching_times
from engine_mount.recordings.recording import Recording
from engine_mount.reports.drive.signals import DriveSignals, Seen
from mount_control import band_pass
from mount_control.delay import LOOP_DELAY, delay_at
from mount_control.policy import continuous_viscous, switched_viscous
from mount_control.policy.contract import Policy
from mount_models.damper import damper_curve

_MEASURED = ('displacement', 'coil_ripple', 'sim/truth', 'sim/chassis_acceleration', 'sim/mount_force')


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
        lowest, full = parameters.lowest_amplitude, parameters.full_amplitude
        return {'damping begins': lowest, 'damping is full': full}
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


def wanted_force(
    drive: DriveSignals, policy: Policy, parameters: Any
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
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
    parameters: switched_viscous.Parameters, velocity: NDArray[np.float64], sample_time: float
) -> NDArray[np.float64]:
    """Return the force (N) of the characteristic at the true velocity (m/s, (n,)) in the band, undelayed."""
    from scipy.signal import lfilter  # loads long

    band = band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, sample_time)
    banded = lfilter([band.gain, 0.0, -band.gain], [1.0, band.a1, band.a2], velocity)
    return damper_curve(parameters.damper).force(banded)
