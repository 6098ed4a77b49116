"""The figures of a manoeuvre, from what the driven mount and the two beside it did."""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.experiments.check.measures import BANDS, RACK
from engine_mount.experiments.check.suite import Manoeuvre
from engine_mount.experiments.policy.runs import first_extremum
from engine_mount.experiments.recorded_drive.evaluation import rms_in_bands
from engine_mount.recordings.switching import Switching
from engine_mount.reports.drive.evaluation import switching, tracking_error
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Truth
from engine_mount.reports.sections.periodic import cycle_work, distortion, harmonics, whole_periods
from engine_mount.settings.chosen import policy_of
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.mount_choice import seat_of
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import without_friction

_RUNG_OUT = 0.2  # chosen: of the undamped peak, below which the engine counts as at rest
_ORDERS = 8  # of the mount force, as in Fig. 13
_MOST_PERIODS = 16


@dataclass(frozen=True)
class Beside:
    """Another mount on the same excitation: SI, arrays (n,) at 1 kHz from the begin of the excitation on."""

    displacement: FloatArray
    velocity: FloatArray
    mount_force: FloatArray
    chassis_acceleration: FloatArray


@dataclass(frozen=True)
class Driven:
    """The driven mount: its signals, the truth from the begin of the excitation on, the nodes' parameters."""

    drive: DriveSignals
    truth: Truth
    parameters: Mapping[str, Mapping[str, Any]]

    @functools.cached_property
    def switching(self) -> Switching:
        """When damping was switched, in s from the begin of the excitation on."""
        return switching(self.drive.seen)

    @functools.cached_property
    def sim(self) -> SimParameters:
        """The parameters of the simulator."""
        return with_flattened(SimParameters(), self.parameters['mount_sim'])


def figures_of(driven: Driven, beside: Mapping[str, Beside], manoeuvre: Manoeuvre) -> dict[str, float]:
    """Return {measure: number}; NaN is not known; losses and gaps are told by the recording."""
    if manoeuvre.seat == RACK:
        return {**_of_rack(driven, beside), **_of_control(driven)}
    part = slice(round(manoeuvre.evaluated_from / SAMPLE_TIME), None)
    return {**_of_motion(driven.truth, beside, part), **_of_control(driven)}


def _of_motion(truth: Truth, beside: Mapping[str, Beside], part: slice) -> dict[str, float]:
    quiet = _RUNG_OUT * float(np.max(np.abs(beside['undamped'].displacement[part])))
    own = _motion(truth, part, quiet)
    found = {
        'peak_displacement_mm': 1e3 * own['peak'],
        'rms_displacement_mm': 1e3 * own['rms'],
        'first_extremum_mm': 1e3 * own['first_extremum'],
        'ringing_s': own['ringing'],
    }
    for other, signals in beside.items():
        its = _motion(signals, part, quiet)
        found |= {f'{name}_over_{other}': _ratio(own[name], its[name]) for name in own}
    return found


def _motion(signals: Truth | Beside, part: slice, quiet: float) -> dict[str, float]:
    """Return what is compared between mounts; it rings as long as the displacement exceeds `quiet` (m)."""
    displacement, acceleration = signals.displacement[part], signals.chassis_acceleration[part]
    beyond = np.flatnonzero(np.abs(displacement) > quiet)
    shaken = rms_in_bands(acceleration - np.mean(acceleration), BANDS)
    return {
        'peak': float(np.max(np.abs(displacement))),
        'rms': float(np.sqrt(np.mean(displacement**2))),
        'first_extremum': first_extremum(displacement),
        'ringing': SAMPLE_TIME * float(beyond[-1]) if beyond.size else 0.0,
        **{f'chassis_{low:g}_{high:g}hz': rms for (low, high), rms in zip(BANDS, shaken, strict=True)},
    }


def _of_rack(driven: Driven, beside: Mapping[str, Beside]) -> dict[str, float]:
    frequency = driven.sim.bench.frequency
    own, its = (_loop(each, frequency) for each in (driven.truth, beside['hydromount']))
    return {
        'distortion_percent': 100.0 * own[0],
        'distortion_over_hydromount': _ratio(own[0], its[0]),
        'cycle_loss_j': own[1],
        'cycle_loss_over_hydromount': _ratio(own[1], its[1]),
    }


def _loop(signals: Truth | Beside, frequency: float) -> tuple[float, float]:
    """Return distortion and work (J) per period of the mount force over the last whole periods."""
    time = SAMPLE_TIME * np.arange(signals.displacement.size)
    part, periods = whole_periods(time, frequency, _MOST_PERIODS)
    force = signals.mount_force[part]
    amplitudes = harmonics(time[part], force, frequency, _ORDERS)
    return distortion(amplitudes), cycle_work(signals.displacement[part], force, periods)


def _of_control(driven: Driven) -> dict[str, float]:
    seen, truth = driven.drive.seen, driven.truth
    excited = (seen.time >= 0.0) & (seen.time <= truth.time[-1])
    if without_friction(seat_of(driven.parameters)):
        error = math.nan
    else:
        error = tracking_error(driven.drive, *policy_of(driven.parameters))
    return {
        'friction_error_percent': 100.0 * error,
        'switched_on': float(len(driven.switching.on)),
        'damping_share_percent': 100.0 * float(np.mean(seen.damping_active[excited])),
        'pad_energy_j': SAMPLE_TIME * float(np.sum(np.abs(truth.friction_force * truth.velocity))),
        'peak_current_a': float(np.max(np.abs(seen.current[excited]))),
        'coil_power_w': driven.sim.coil.resistance * float(np.mean(truth.coil_current**2)),
    }


def _ratio(value: float, reference: float) -> float:
    return value / reference if reference > 0.0 else math.nan
