"""Whole periods of a mount on the rack, and their figures: harmonics, loss, smoothness."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.contract import ExperimentError
from engine_mount.reports.drive.signals import DriveSignals, FloatArray
from engine_mount.reports.sections.periodic import cycle_work, distortion, harmonics, whole_periods
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.damper import damper_curve
from mount_models.quantity import Quantity

HYDRO, OFF, COULOMB = 'hydromount', 'friction, 0 A', 'Coulomb'
ORDERS = 8


class BenchParameters(NamedTuple):
    """The rack's sine, the damper characteristic at the top of the figures, and what is evaluated."""

    frequency: Annotated[float, Quantity('Hz', 'frequency of the sine', 0.5, 50.0, 'Sec. 6')] = 8.0
    amplitude: Annotated[float, Quantity('m', 'amplitude of the sine', 1e-5, 0.01)] = 0.001
    damper: str = DEFAULT_DAMPER
    settling: Annotated[float, Quantity('s', 'excitation that is not evaluated', 0.5, 60.0)] = 2.5
    periods: Annotated[int, Quantity('1', 'whole periods that are evaluated', 2, 1000)] = 16
    coulomb_force: Annotated[float, Quantity('N', 'plain Coulomb damper', 0.0, 1e4)] = 100.0
    coulomb_stiffness: Annotated[float, Quantity('N/m', 'spring beside it', 0.0, 1e8)] = 1.6e5


@dataclass(frozen=True)
class Loop:
    """Whole periods of one mount: displacement (m), velocity, forces (N), arrays (n,), and their figures."""

    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    friction_force: FloatArray
    wanted_force: FloatArray
    figures: dict[str, Any]


def loop_of(drive: DriveSignals, parameters: BenchParameters, damper: str) -> Loop:
    """Return the evaluated periods of a run with the characteristic `damper`, '' for none.

    Raises `ExperimentError` if fewer were recorded.
    """
    truth = drive.truth
    part, periods = whole_periods(truth.time, parameters.frequency, parameters.periods)
    if periods < parameters.periods:
        raise ExperimentError(
            f'{periods} whole periods of {parameters.periods} were recorded in {drive.recording}'
        )
    time = truth.time[part]
    wanted = damper_curve(damper).force(truth.velocity[part]) if damper else np.zeros(len(time))
    friction = truth.friction_force[part]
    figures = _figures_of(time, truth.displacement[part], truth.mount_force[part], parameters)
    figures['friction_harmonics_n'] = harmonics(time, friction, parameters.frequency, ORDERS).tolist()
    figures['wanted_harmonics_n'] = harmonics(time, wanted, parameters.frequency, ORDERS).tolist()
    figures['steepest_share'] = _steepest(friction)
    figures['damping_active_share'] = _active_share(drive, time)
    return Loop(
        truth.displacement[part], truth.velocity[part], truth.mount_force[part], friction, wanted, figures
    )


def _active_share(drive: DriveSignals, time: FloatArray) -> float:
    seen = drive.seen
    within = (seen.time >= time[0]) & (seen.time <= time[-1])
    return float(np.mean(seen.damping_active[within]))


def coulomb_loop(moved: Loop, parameters: BenchParameters) -> Loop:
    """Return what a spring and a constant friction force would do on the recorded displacement."""
    x, velocity = moved.displacement, moved.velocity
    friction = parameters.coulomb_force * _mean_sign(velocity)
    force = parameters.coulomb_stiffness * x + friction
    rate = 1e3  # the recording's
    figures = _figures_of(np.arange(len(x)) / rate, x, force, parameters)
    figures['steepest_share'] = _steepest(friction)
    return Loop(x, velocity, force, friction, friction, figures)


def _mean_sign(velocity: FloatArray) -> FloatArray:
    """Return the mean sign in the sample interval round each velocity.

    The sign of the samples alone would reverse up to half a sample late and so make even harmonics.
    """
    ends = np.interp(np.arange(len(velocity) + 1) - 0.5, np.arange(len(velocity)), velocity)
    steps = np.diff(ends)
    return np.where(
        steps == 0.0, np.sign(velocity), np.diff(np.abs(ends)) / np.where(steps == 0.0, 1.0, steps)
    )


def _figures_of(
    time: FloatArray, displacement: FloatArray, force: FloatArray, parameters: BenchParameters
) -> dict[str, Any]:
    amplitudes = harmonics(time, force, parameters.frequency, ORDERS)
    loss = cycle_work(displacement, force, parameters.periods)
    return {
        'harmonics_n': amplitudes.tolist(),
        'thd': distortion(amplitudes),
        'loss_energy_j': loss,
        'loss_stiffness_n_per_m': loss / (math.pi * parameters.amplitude**2),
        'peak_force_n': float(np.max(np.abs(force))),
    }


def _steepest(force: FloatArray) -> float | None:
    """Return the largest change within a sample as a share of the peak, None where there is no force."""
    peak = float(np.max(np.abs(force)))
    return float(np.max(np.abs(np.diff(force)))) / peak if peak > 1e-3 else None
