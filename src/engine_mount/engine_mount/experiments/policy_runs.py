"""One run of a policy, in a process of its own, and its figures."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.harness.contract import Settings, Values
from engine_mount.experiments.harness.many_runs import TruthOnly
from engine_mount.experiments.harness.measures import first_extremum, peak_and_rms, rms_in_bands
from engine_mount.reports.drive.signals import FloatArray
from engine_mount.reports.sections.periodic import distortion, harmonics, whole_periods
from engine_mount.signals.excitation import acceleration_at, recorded_signal
from engine_mount.signals.roads.inversion import road_of
from mount_models.arithmetic.series import series_of
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.excitation import Excitation, Seat, idle_force
from mount_sim.excitation.scenario import STEP_TIME, IdleForce, RecordedScenario
from mount_sim.parameters import SimParameters
from mount_sim.plant.vehicle import Vehicle


@functools.cache
def recorded_road(recorded: RecordedScenario) -> FloatArray:
    """Return the road (m) behind a recorded acceleration, at the step of the plant; raises `SignalError`."""
    acceleration = acceleration_at(recorded_signal(recorded), STEP_TIME)
    return road_of(acceleration[:], STEP_TIME, Vehicle())


def on_recorded_road(recorded: RecordedScenario, idle: IdleForce, start: float) -> Excitation:
    """Return the drive over the road behind a recording, with an idling engine."""
    road = recorded_road(recorded)
    forces = idle_force(idle.amplitude, idle.frequency, idle.second_share, road.size, STEP_TIME)
    return Excitation(Seat.VEHICLE, series_of(road), STEP_TIME, start, forces)


BAND = (4.0, 14.0)  # Hz: where the engine may shake
_SMOOTH = 30.0  # Hz, chosen: above it no derivative is taken
_RINGING = (0.06, 0.45)  # s behind the gap: the first extremum is past, the ringing not
_MASS = 80.0  # kg: the share of the engine that the estimate believes in


def frequency_in_band(displacement: FloatArray) -> float:
    """Return the rms velocity over the rms displacement (Hz) within `BAND`: how fast the phasor turns."""
    spectrum, frequency = _spectrum(displacement)
    within = (frequency >= BAND[0]) & (frequency <= BAND[1])
    power = np.abs(spectrum[within]) ** 2
    return float(np.sqrt(np.sum(power * frequency[within] ** 2) / np.sum(power)))


def friction_scale(displacement: FloatArray, assumed_force: FloatArray) -> float:
    """Return the pads' friction over the `assumed_force` (N), from the ringing behind a gap at sample 0.

    Least squares of acceleration over displacement, velocity, assumed force and a constant.
    """
    first, last = (round(edge / SAMPLE_TIME) for edge in _RINGING)
    part = slice(first, last)
    columns = [_derivative(displacement, 0), _derivative(displacement, 1), _derivative(assumed_force, 0)]
    base = np.stack([*(column[part] for column in columns), np.ones(last - first)], 1)
    solution = np.linalg.lstsq(base, _derivative(displacement, 2)[part], rcond=None)[0]
    return float(-_MASS * solution[2])


def _derivative(values: FloatArray, order: int) -> FloatArray:
    spectrum, frequency = _spectrum(values)
    spectrum[frequency > _SMOOTH] = 0.0
    return np.asarray(np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, values.size), np.float64)


def _spectrum(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.fft.rfft(values), np.fft.rfftfreq(values.size, SAMPLE_TIME)


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


@dataclass(frozen=True)
class PolicyJob:
    """One run: its key, the parameters of the nodes, what is looked at, and what no scenario holds.

    `damper` (N s/m, m/s) is the law that the rack's force is compared with. `kept`: the displacement is
    returned too.
    """

    key: tuple[Any, ...]
    parameters: Settings
    kind: str
    recorded: RecordedScenario | None = None
    damper: tuple[float, float] = (0.0, 0.0)
    kept: bool = False


def run_policy_job(job: PolicyJob) -> tuple[tuple[Any, ...], Values]:
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


def _of_sweep(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> Values:
    return peak_and_rms(signals['displacement'], signals['chassis_acceleration'])


def _of_gap(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> Values:
    behind = signals['displacement'][round(sim.motorway.gap_time / SAMPLE_TIME) :]
    force = signals['friction_force'][-behind.size :] / sim.friction.scale
    return {
        'peak_m': float(np.max(np.abs(behind))),
        'first_m': first_extremum(behind),
        'friction_scale': friction_scale(behind, force),
    }


def _of_rack(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> Values:
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


def _of_road(signals: dict[str, FloatArray], sim: SimParameters, job: PolicyJob) -> Values:
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
