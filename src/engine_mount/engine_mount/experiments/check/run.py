"""The suite driven: orders checked before the first manoeuvre, then several at a time."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from engine_mount.drives.drive import Drive, check_drive, drive
from engine_mount.experiments.check.suite import BANDS, RACK, Manoeuvre, Result
from engine_mount.experiments.harness.closed_loop import truth_of_run
from engine_mount.experiments.harness.experiment import Settings, Values
from engine_mount.experiments.harness.measures import first_extremum, rms
from engine_mount.fleet.runner import run_tasks
from engine_mount.recordings.access import audit
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.drive.signals import (
    DriveSignals,
    Truth,
    load_drive,
    samples_at_the_ends,
    switching,
    tracking_error,
)
from engine_mount.reports.sections.periodic import (
    cycle_work,
    distortion,
    harmonics,
    rms_in_bands,
    whole_periods,
)
from engine_mount.settings.chosen import policy_of
from engine_mount.settings.options import mounts_of
from mount_bringup.settings import checked_settings
from mount_models.quantity import ParameterError, with_flattened
from mount_models.sampling import SAMPLE_RATE, SAMPLE_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seat_of, with_control_of_mount, without_friction

DRIVEN, HYDRO, UNDAMPED = 'driven', 'hydromount', 'undamped'
_BESIDE = {HYDRO: 'hydro', UNDAMPED: 'friction_off'}
_RUNG_OUT = 0.2  # chosen: of the undamped peak, below which the engine counts as at rest
_MOST_PERIODS = 16


class CheckError(ValueError):
    """The suite cannot be driven as ordered; the text says why and the remedy."""


class Trial(NamedTuple):
    """A manoeuvre with the parameters of all nodes, how long it takes (s), and its folder."""

    manoeuvre: Manoeuvre
    parameters: dict[str, Values]
    seconds: float
    out: Path


def trials_of(suite: Sequence[Manoeuvre], settings: Settings, out: Path) -> list[Trial]:
    """Return the drives of a suite, each refused with its manoeuvre before any begins; a `ValueError`.

    `settings` are the user's {node: {parameter: value}}.
    """
    checked = checked_settings(settings)
    if mounts_of(checked):
        raise CheckError('a suite checks one mount; leave out mount_sim.mounts')
    for node, values in checked.items():
        if values.get('sample_rate', SAMPLE_RATE) != SAMPLE_RATE:
            raise CheckError(f'a suite is judged at {SAMPLE_RATE:g} Hz; leave out {node}.sample_rate')
    trials = []
    for each in suite:
        merged = {node: dict(values) for node, values in each.settings.items()}
        for node, values in checked.items():
            own = merged.setdefault(node, {})
            for name in sorted(values.keys() & own.keys()):
                raise CheckError(
                    f'{node}.{name} is set by the manoeuvre {each.name} itself; leave it out, or give a '
                    'suite of your own with --suite'
                )
            own |= values
        parameters = with_control_of_mount(merged)
        try:
            excitation = check_drive(parameters, core=True)
        except ParameterError as error:
            raise CheckError(f'{each.name}: {error}') from None
        if each.evaluated_from >= excitation.duration:
            raise CheckError(
                f'{each.name}: evaluated_from_s ({each.evaluated_from:g} s) must lie before the end of the '
                f'excitation ({excitation.duration:g} s)'
            )
        trials.append(Trial(each, parameters, excitation.start + excitation.duration, out / each.name))
    return trials


def run_trials(
    trials: Sequence[Trial], jobs: int, screen: Screen, done: Callable[[Trial, Result], None]
) -> dict[str, Result]:
    """Drive all, call `done` with each, and return {manoeuvre: what came of it} in their order."""
    results: dict[str, Result] = {}
    whole, driven = sum(trial.seconds for trial in trials), 0.0
    with screen.bar('checking', transient=True) as bar:
        for task in run_tasks(run_trial, trials, workers=jobs):
            if task.error is not None:
                raise task.error
            trial, result = trials[task.place], task.result or Result({}, broke_down=task.reason)
            driven += trial.seconds
            bar(driven / whole, trial.manoeuvre.name)
            results[trial.manoeuvre.name] = result
            done(trial, result)
    return {trial.manoeuvre.name: results[trial.manoeuvre.name] for trial in trials}


def run_trial(trial: Trial) -> Result:
    """Drive one manoeuvre and return what came of it.

    One that breaks down, or whose recording cannot be judged, says so in its result: the others go on.
    """
    try:
        run = drive(core=True, parameters=trial.parameters, out=trial.out)
        return result_of(trial, open_recording(run.recording), run)
    except ValueError as error:
        return Result({}, broke_down=str(error))


def result_of(trial: Trial, recording: Recording, run: Drive) -> Result:
    """Return figures and remarks of a recorded manoeuvre."""
    parameters, audited = trial.parameters, audit(recording)
    lost = audited.losses
    signals = load_drive(recording, run.excitation_start)
    at_ends = samples_at_the_ends(recording, audited.topics, run.samples)
    remarks = [*run.complaints, *audited.warnings, *at_ends]
    stamps = recording['control_trace'].stamps
    late = (int(stamps.min()) - signals.zero) / 1e9 if len(stamps) else math.inf
    if late > 0.0:
        remarks.append(f'control began {late:.1f} s after the excitation: it was initialised late')
    # other mounts on the same excitation: no bus, no recording, the same plant
    beside = {
        name: truth_of_run({**parameters, 'mount_sim': {**parameters['mount_sim'], 'mount': mount}})
        for name, mount in _BESIDE.items()
    }
    truths = {DRIVEN: signals.truth.since(0.0), **beside}
    gap, truth = recording['air_gap'], recording['sim/truth']
    figures = {
        **figures_of(truths, trial.manoeuvre, parameters),
        **control_figures(signals, truths[DRIVEN], parameters),
        **{
            f'{name}_error_um': 1e6 * abs(float(gap[name][-1]) - float(truth[name][-1]))
            for name in ('rest_gap', 'contact_gap')
        },
        'lost_samples': _known(lost.lost_samples),
        'unanswered_samples': _known(lost.unanswered),
        'faults': float(len(lost.faults)),
        'remarks': float(len(remarks)),
    }
    return Result(figures, [*remarks, *lost.complaints()])


def _known(count: int | None) -> float:
    return math.nan if count is None else float(count)


def figures_of(truths: Mapping[str, Truth], manoeuvre: Manoeuvre, parameters: Settings) -> dict[str, float]:
    """Return {measure: number} of the driven mount and over the others; NaN is not known."""
    if manoeuvre.seat == RACK:
        frequency = with_flattened(SimParameters(), parameters['mount_sim']).bench.frequency
        own, its = (_loop(truths[name], frequency) for name in (DRIVEN, HYDRO))
        return {
            'distortion_percent': 100.0 * own[0],
            'distortion_over_hydromount': _ratio(own[0], its[0]),
            'cycle_loss_j': own[1],
            'cycle_loss_over_hydromount': _ratio(own[1], its[1]),
        }
    part = slice(round(manoeuvre.evaluated_from / SAMPLE_TIME), None)
    quiet = _RUNG_OUT * float(np.max(np.abs(truths[UNDAMPED].displacement[part])))
    motions = {name: _motion(truth, part, quiet) for name, truth in truths.items()}
    moved = motions.pop(DRIVEN)
    found = {
        'peak_displacement_mm': 1e3 * moved['peak'],
        'rms_displacement_mm': 1e3 * moved['rms'],
        'first_extremum_mm': 1e3 * moved['first_extremum'],
        'ringing_s': moved['ringing'],
    }
    for other, motion in motions.items():
        found |= {f'{name}_over_{other}': _ratio(moved[name], motion[name]) for name in moved}
    return found


def _motion(truth: Truth, part: slice, quiet: float) -> dict[str, float]:
    """Return what is compared between mounts; it rings as long as the displacement exceeds `quiet` (m)."""
    displacement, acceleration = truth.displacement[part], truth.chassis_acceleration[part]
    beyond = np.flatnonzero(np.abs(displacement) > quiet)
    shaken = rms_in_bands(acceleration - np.mean(acceleration), BANDS)
    return {
        'peak': np.max(np.abs(displacement)),
        'rms': rms(displacement),
        'first_extremum': first_extremum(displacement),
        'ringing': SAMPLE_TIME * float(beyond[-1]) if beyond.size else 0.0,
        **{f'chassis_{low:g}_{high:g}hz': each for (low, high), each in zip(BANDS, shaken, strict=True)},
    }


def _loop(truth: Truth, frequency: float) -> tuple[float, float]:
    """Return distortion and work (J) per period of the mount force over the last whole periods."""
    time = SAMPLE_TIME * np.arange(truth.time.size)
    part, periods = whole_periods(time, frequency, _MOST_PERIODS)
    force = truth.mount_force[part]
    work = cycle_work(truth.displacement[part], force, periods)
    return distortion(harmonics(time[part], force, frequency)), work


def _ratio(value: float, reference: float) -> float:
    return value / reference if reference > 0.0 else math.nan


def control_figures(signals: DriveSignals, truth: Truth, parameters: Settings) -> dict[str, float]:
    """Return {measure: number} of the control; the friction error of a mount without friction is NaN."""
    seen = signals.seen
    excited = (seen.time >= 0.0) & (seen.time <= truth.time[-1])
    error, resistance = math.nan, with_flattened(SimParameters(), parameters['mount_sim']).coil.resistance
    if not without_friction(seat_of(parameters)):
        error = tracking_error(signals, *policy_of(parameters))
    return {
        'friction_error_percent': 100.0 * error,
        'switched_on': float(len(switching(seen).on)),
        'damping_share_percent': 100.0 * np.mean(seen.damping_active[excited]),
        'pad_energy_j': SAMPLE_TIME * np.sum(np.abs(truth.friction_force * truth.velocity)),
        'peak_current_a': np.max(np.abs(seen.current[excited])),
        'coil_power_w': resistance * np.mean(truth.coil_current**2),
    }
