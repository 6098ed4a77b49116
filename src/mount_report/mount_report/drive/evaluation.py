"""How well friction followed what was wanted in a drive, when damping was on, and what its ends lack."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mount_bags.audit.audit import TopicAudit
from mount_bags.bag.recording import Recording
from mount_bags.events.switching_changes import Switching
from mount_control import band_pass
from mount_control.policy import switched_viscous
from mount_models.damper import DamperCurve
from mount_models.sampling import SAMPLE_TIME
from mount_report.drive.signals import DriveSignals, Seen

_MEASURED = ('displacement', 'coil_ripple', 'sim/truth', 'sim/chassis_acceleration', 'sim/mount_force')


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


def switching(seen: Seen) -> Switching:
    """Return the times at which damping was switched."""
    change = np.diff(seen.damping_active.astype(int), prepend=0)
    return Switching(tuple(seen.time[change > 0].tolist()), tuple(seen.time[change < 0].tolist()))


def tracking_error(
    drive: DriveSignals, parameters: switched_viscous.Parameters, damper: DamperCurve
) -> float:
    """Return the rms error of the friction force while damping is on, as a share of the peak wanted force.

    NaN if damping was never on.
    """
    wanted, places = wanted_force(drive, parameters, damper)
    on = places[drive.seen.damping_active]
    if len(on) == 0:
        return math.nan
    error = drive.truth.friction_force[on] - wanted[on]
    return float(np.sqrt(np.mean(error**2)) / np.max(np.abs(wanted[on])))


def wanted_force(
    drive: DriveSignals, parameters: switched_viscous.Parameters, damper: DamperCurve
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the wanted friction force (N) at the true times, and which of them belongs to each sample.

    Wanted is what the selected damper would do at the true velocity of the mount in the band at that very
    moment, without any delay; so an error against it holds phase and delay as well as force.
    """
    band = band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, SAMPLE_TIME)
    wanted = damper.force(band_pass.filtered(band, drive.truth.velocity))
    places = np.clip(
        np.searchsorted(drive.truth.time, drive.seen.time - 0.5 * SAMPLE_TIME), 0, len(wanted) - 1
    )
    return wanted, places
