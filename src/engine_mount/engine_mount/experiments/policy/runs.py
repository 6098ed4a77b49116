"""One run of a policy, in a process of its own, and its figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.policy.excitations import on_recorded_road
from engine_mount.experiments.policy.learnable import frequency_in_band, friction_scale
from engine_mount.experiments.recorded_drive.evaluation import rms_in_bands
from engine_mount.experiments.sensitivity.grid import TruthOnly
from engine_mount.experiments.sweep.evaluation import peak_and_rms
from engine_mount.reports.drive.signals import FloatArray
from engine_mount.reports.sections.periodic import distortion, harmonics, whole_periods
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.scenario import RecordedScenario
from mount_sim.parameters import SimParameters

ACOUSTIC = (20.0, 200.0)  # Hz: what the chassis passes on
_FIELDS = (
    'displacement',
    'velocity',
    'friction_force',
    'mount_force',
    'chassis_acceleration',
    'coil_current',
)
_ONE_HERTZ = [(float(low), low + 1.0) for low in range(100)]  # Hz: bands of the shown spectrum
_SETTLING = 1.0  # s, chosen: a road fades in for so long
_PERIODS, _ORDERS = 8, 8
_CLEAR = 0.3  # chosen: a turning point of so much of the largest one counts as the first
_FIRST_WITHIN = 0.3  # s


@dataclass(frozen=True)
class PolicyJob:
    """One run: its key, the parameters of the nodes, what is looked at, and what no scenario holds.

    `damper` (N s/m, m/s) is the law that the rack's force is compared with. `kept`: the displacement is
    returned too.
    """

    key: tuple[Any, ...]
    parameters: Mapping[str, Mapping[str, Any]]
    kind: str
    recorded: RecordedScenario | None = None
    damper: tuple[float, float] = (0.0, 0.0)
    kept: bool = False


def run_policy_job(job: PolicyJob) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Run one job through the same closed loop as every drive in core; return its key and its figures."""
    truth = TruthOnly(_FIELDS)
    sim = with_flattened(SimParameters(), job.parameters['mount_sim'])
    excitation = None
    if job.recorded is not None:
        excitation = on_recorded_road(job.recorded, sim.idle, sim.timeline.start)
    outcome = run_core_into(truth, job.parameters, excitation=excitation)
    signals = dict(zip(_FIELDS, truth.signals(outcome.excitation_start), strict=True))
    figures = _FIGURES[job.kind](signals, sim, job)
    if job.kept:
        figures['displacement'] = signals['displacement']
    return job.key, figures


def _of_sweep(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> dict[str, Any]:
    return peak_and_rms(signals['displacement'], signals['chassis_acceleration'])


def _of_gap(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> dict[str, Any]:
    behind = signals['displacement'][round(sim.motorway.gap_time / SAMPLE_TIME) :]
    force = signals['friction_force'][-behind.size :] / sim.friction.scale
    return {
        'peak_m': float(np.max(np.abs(behind))),
        'first_m': first_extremum(behind),
        'friction_scale': friction_scale(behind, force),
    }


def first_extremum(displacement: FloatArray) -> float:
    """Return the size (m) of the first clear turning point of a displacement from the gap on."""
    part = displacement[: round(_FIRST_WITHIN / SAMPLE_TIME)]
    slope = np.diff(part)
    turning = np.flatnonzero(slope[1:] * slope[:-1] <= 0.0) + 1
    moved = np.abs(part - part[0])
    clear = turning[moved[turning] > _CLEAR * moved.max()]
    return float(np.abs(part[clear[0]])) if clear.size else float(np.abs(part).max())


def _of_rack(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> dict[str, Any]:
    frequency = sim.bench.frequency
    time = SAMPLE_TIME * np.arange(signals['displacement'].size)
    part, _ = whole_periods(time, frequency, _PERIODS)
    damping, dead = job.damper
    velocity = signals['velocity'][part]
    wanted = np.sign(velocity) * damping * np.maximum(np.abs(velocity) - dead, 0.0)
    error = signals['friction_force'][part] - wanted
    return {
        'thd': 100.0 * distortion(harmonics(time[part], signals['mount_force'][part], frequency, _ORDERS)),
        'tracking': 100.0 * float(np.sqrt(np.mean(error**2)) / np.abs(wanted).max()) if damping else None,
    }


def _of_road(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> dict[str, Any]:
    part = slice(round(_SETTLING / SAMPLE_TIME), None)
    moved = {name: values[part] for name, values in signals.items()}
    acceleration = moved['chassis_acceleration'] - moved['chassis_acceleration'].mean()
    power = np.abs(moved['friction_force'] * moved['velocity'])
    return {
        'acceleration': rms_in_bands(acceleration, [ACOUSTIC])[0],
        'peak_m': float(np.abs(moved['displacement']).max()),
        'rms_m': rms_in_bands(moved['displacement'], [BELOW_ISOLATION])[0],
        'power_w': float(np.mean(power)),
        'frequency_hz': frequency_in_band(moved['displacement']),
        'heat_w': sim.coil.resistance * float(np.mean(moved['coil_current'] ** 2)),
        'spectrum': rms_in_bands(acceleration, _ONE_HERTZ) if job.kept else None,
    }


_FIGURES = {'sweep': _of_sweep, 'gap': _of_gap, 'rack': _of_rack, 'road': _of_road}
