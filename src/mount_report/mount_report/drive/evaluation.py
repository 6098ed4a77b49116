"""The signals of a drive from its recording, and how well friction followed what was wanted."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.audit.audit import TopicAudit
from mount_bags.bag.recording import Recording
from mount_bags.events.switching_changes import Switching
from mount_bags.messages.time_axis import time_axis
from mount_control import band_pass
from mount_control.policy import switched_viscous
from mount_models.damper import DamperCurve
from mount_models.sampling import SAMPLE_TIME

_SECOND = 1e9  # ns
_COLUMNS = {
    'displacement': ('mount',),
    'control_trace': ('damping_active', 'current'),
    'sim/truth': ('velocity', 'friction_force'),
}
_MEASURED = ('displacement', 'coil_ripple', 'sim/truth', 'sim/chassis_acceleration', 'sim/mount_force')


@dataclass(frozen=True)
class Drive:
    """The signals of one drive on their common samples, time in s from the stamp `zero` (ns)."""

    time: NDArray[np.float64]
    displacement: NDArray[np.float64]
    current: NDArray[np.float64]
    damping_active: NDArray[np.bool_]
    true_time: NDArray[np.float64]
    true_velocity: NDArray[np.float64]
    friction_force: NDArray[np.float64]
    zero: int


def load_drive(
    recording: Recording,
    excitation_start: float | None = None,
    others: Mapping[str, Sequence[str]] | None = None,
) -> Drive:
    """Read the signals of a drive, with time from the zero of its time axis on.

    With `excitation_start` (s from the plant's first sample) time begins there. `others` are the columns by
    topic that the caller is about to ask for: they are read in the same pass.
    """
    others = others or {}
    recording.load_columns({name: (*names, *others.get(name, ())) for name, names in _COLUMNS.items()})
    displacement, trace, truth = (recording[name] for name in _COLUMNS)
    zero = time_axis(recording).zero
    if excitation_start is not None:
        zero = excitation_stamp(recording, excitation_start)
    shown, traced, seen = (np.argsort(series.stamps) for series in (displacement, trace, truth))
    stamps = displacement.stamps[shown]
    active = np.zeros(len(stamps), dtype=bool)
    current = np.zeros(len(stamps))
    places, of_trace = _common(stamps, trace.stamps[traced])
    active[places] = (trace['damping_active'][traced] > 0.5)[of_trace]
    current[places] = trace['current'][traced][of_trace]
    return Drive(
        time=(stamps - zero) / _SECOND,
        displacement=displacement['mount'][shown],
        current=current,
        damping_active=active,
        true_time=(truth.stamps[seen] - zero) / _SECOND,
        true_velocity=truth['velocity'][seen],
        friction_force=truth['friction_force'][seen],
        zero=zero,
    )


def excitation_stamp(recording: Recording, start: float) -> int:
    """Return the stamp (ns) at which the excitation began, `start` s after the plant's first sample."""
    return int(recording['sim/truth'].stamps.min()) + round(start * _SECOND)


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


def _common(stamps: NDArray[np.int64], others: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return where the stamps that both have stand in each."""
    _, places, of_others = np.intersect1d(stamps, others, return_indices=True)
    return places, of_others


def switching(drive: Drive) -> Switching:
    """Return the times at which damping was switched."""
    change = np.diff(drive.damping_active.astype(int), prepend=0)
    return Switching(tuple(drive.time[change > 0].tolist()), tuple(drive.time[change < 0].tolist()))


def tracking_error(drive: Drive, parameters: switched_viscous.Parameters, damper: DamperCurve) -> float:
    """Return the rms error of the friction force while damping is on, as a share of the peak wanted force.

    NaN if damping was never on.
    """
    wanted, places = wanted_force(drive, parameters, damper)
    on = places[drive.damping_active]
    if len(on) == 0:
        return math.nan
    error = drive.friction_force[on] - wanted[on]
    return float(np.sqrt(np.mean(error**2)) / np.max(np.abs(wanted[on])))


def wanted_force(
    drive: Drive, parameters: switched_viscous.Parameters, damper: DamperCurve
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the wanted friction force (N) at the true times, and which of them belongs to each sample.

    Wanted is what the selected damper would do at the true velocity of the mount in the band at that very
    moment, without any delay; so an error against it holds phase and delay as well as force.
    """
    band = band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, SAMPLE_TIME)
    wanted = damper.force(band_pass.filtered(band, drive.true_velocity))
    places = np.clip(np.searchsorted(drive.true_time, drive.time - 0.5 * SAMPLE_TIME), 0, len(wanted) - 1)
    return wanted, places
