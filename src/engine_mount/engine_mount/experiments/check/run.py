"""The suite driven: orders checked before the first manoeuvre, in core several at a time."""

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from engine_mount.drives.drive import Drive, check_drive, drive
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.check.suite import BANDS, RACK, Manoeuvre
from engine_mount.experiments.harness.contract import Settings
from engine_mount.experiments.harness.many_runs import TruthOnly
from engine_mount.experiments.harness.measures import first_extremum, rms_in_bands
from engine_mount.fleet.runner import run_tasks
from engine_mount.recordings.audit import audit
from engine_mount.recordings.events import Switching
from engine_mount.recordings.losses import Losses, losses
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.drive.evaluation import samples_at_the_ends, switching, tracking_error
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Truth, load_drive
from engine_mount.reports.sections.periodic import cycle_work, distortion, harmonics, whole_periods
from engine_mount.settings.chosen import policy_of
from engine_mount.settings.mounts import mounts_of
from mount_bringup.graph.nodes import GraphError
from mount_bringup.settings import checked_settings
from mount_models.quantity import ParameterError, with_flattened
from mount_models.sampling import SAMPLE_RATE, SAMPLE_TIME
from mount_sim.mount_choice import seat_of, with_control_of_mount
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
    parameters: Settings

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


CORE, LOCKSTEP, GRAPH = 'core', 'lockstep', 'graph'
MODES = {CORE: 'core', LOCKSTEP: 'lock-step', GRAPH: 'real time'}
"""{what `--through` says: what a drive calls it}."""
MOUNT_OF = {'hydromount': 'hydro', 'undamped': 'friction_off'}
_FIELDS = ('displacement', 'velocity', 'mount_force', 'chassis_acceleration')


@dataclass(frozen=True)
class Trial:
    """A manoeuvre with the parameters of all nodes, driven `through` what, into the folder `out`.

    `seconds` is how long the drive is.
    """

    manoeuvre: Manoeuvre
    parameters: Settings
    through: str
    out: Path
    domain: int = 0
    priority: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Shown:
    """What the page draws: signals over time (s from the begin of the excitation) by mount, SI.

    `damping` are the stretches (s) with damping on.
    """

    displacement: Mapping[str, FloatArray] = field(default_factory=dict)
    force: Mapping[str, FloatArray] = field(default_factory=dict)
    current: FloatArray = field(default_factory=lambda: np.zeros(0))
    damping: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Result:
    """The figures of a manoeuvre by the names of their measures, and what was not as it should be.

    `broke_down`: why there are no figures, empty where there are.
    """

    figures: Mapping[str, float]
    remarks: tuple[str, ...]
    shown: Shown
    broke_down: str = ''


def run_trial(trial: Trial) -> Result:
    """Drive one manoeuvre and return what came of it; raises `Interrupted`.

    One that breaks down, or whose recording cannot be judged, is `broken_down`: the others go on.
    """
    try:
        run = drive(
            core=trial.through == CORE,
            lockstep=trial.through == LOCKSTEP,
            parameters=trial.parameters,
            domain=trial.domain,
            out=trial.out / trial.manoeuvre.name,
            priority=trial.priority,
        )
        return _result(trial, open_recording(run.recording), run)
    except (GraphError, ValueError) as error:
        return broken_down(str(error))


def broken_down(reason: str) -> Result:
    """Return the result of a manoeuvre of which no figure is known."""
    return Result({}, (), Shown(), reason)


def _result(trial: Trial, recording: Recording, run: Drive) -> Result:
    audits = audit(recording)
    found = losses(recording, audits)
    remarks = [*run.complaints, *recording.warnings, *samples_at_the_ends(recording, audits, run.samples)]
    beside = {other: _alone(trial.parameters, mount) for other, mount in MOUNT_OF.items()}
    signals = load_drive(recording, run.excitation_start)
    remarks += _late_control(recording, signals.zero)
    truth = at_samples(signals.truth, beside['undamped'].displacement.size)
    driven = Driven(signals, truth, trial.parameters)
    figures = {
        **figures_of(driven, beside, trial.manoeuvre),
        **_gap_errors(recording),
        **_of_losses(found),
        'remarks': float(len(remarks)),
        'latency_p99_us': 1e6 * run.latency_p99 if trial.through == GRAPH else math.nan,
    }
    told = [*remarks, *found.complaints()]
    return Result(figures, tuple(told), _shown(driven, beside))


def _late_control(recording: Recording, excited: int) -> list[str]:
    """Return a sentence if control began to answer behind the stamp `excited` (ns), where it has to."""
    stamps = recording['control_trace'].stamps
    begin = (int(stamps.min()) - excited) / 1e9 if len(stamps) else math.inf
    return (
        [f'control began {begin:.1f} s after the excitation: it was initialised late'] if begin > 0.0 else []
    )


def at_samples(truth: Truth, count: int) -> Truth:
    """Return the truth at the `count` samples of the excitation, those that are missing on a straight line.

    In real time the electronics go on behind the end of the excitation, and a recording may lack samples.
    """
    places = np.round(truth.time / SAMPLE_TIME)
    inside = (places >= 0) & (places < count)
    values = {field.name: getattr(truth, field.name)[inside] for field in fields(Truth)}
    if int(inside.sum()) == count:
        return Truth(**values)
    samples = np.arange(count)
    found = {name: np.interp(samples, places[inside], each) for name, each in values.items()}
    return Truth(**found)


def _alone(parameters: Settings, mount: str) -> Beside:
    """Return another mount on the same excitation: no bus, no recording, the same plant."""
    truth = TruthOnly(_FIELDS)
    sim = {**parameters['mount_sim'], 'mount': mount}
    outcome = run_core_into(truth, {**parameters, 'mount_sim': sim})
    return Beside(*truth.signals(outcome.excitation_start))


def _gap_errors(recording: Recording) -> dict[str, float]:
    gap, truth = recording['air_gap'], recording['sim/truth']
    return {
        f'{name}_error_um': 1e6 * abs(float(gap[name][-1]) - float(truth[name][-1]))
        for name in ('rest_gap', 'contact_gap')
    }


def _of_losses(found: Losses) -> dict[str, float]:
    return {
        'lost_samples': _known(found.lost_samples),
        'unanswered_samples': _known(found.unanswered),
        'faults': float(len(found.faults)),
    }


def _known(count: int | None) -> float:
    return math.nan if count is None else float(count)


def _shown(driven: Driven, beside: Mapping[str, Beside]) -> Shown:
    truth, changes = driven.truth, driven.switching
    ends = (*changes.off, float(driven.drive.seen.time[-1]))
    return Shown(
        displacement={'driven': truth.displacement}
        | {name: other.displacement for name, other in beside.items()},
        force={'driven': truth.mount_force} | {name: other.mount_force for name, other in beside.items()},
        current=truth.coil_current,
        damping=tuple((on, min(end for end in ends if end >= on)) for on in changes.on),
    )


Told = Callable[[str, Result, float], None]
"""Takes a manoeuvre that is done, what came of it, and the share of all that is done with it (0..1)."""

_AROUND = 8.0  # s, chosen: through nodes, their start and end


class CheckError(ValueError):
    """The suite cannot be driven as ordered; the text says why and the remedy."""


@dataclass(frozen=True)
class CheckOrder:
    """What is to be checked: manoeuvres, the user's {node: {parameter: value}}, and how they are driven.

    `jobs` manoeuvres at a time in core, 0: one for each core of the machine.
    """

    manoeuvres: Sequence[Manoeuvre]
    through: str = CORE
    settings: Settings = field(default_factory=dict)
    jobs: int = 0
    domain: int = 0
    priority: int = 0


def trials_of(order: CheckOrder, out: Path) -> list[Trial]:
    """Return the drives of an order, each refused with its manoeuvre before any begins; a `ValueError`."""
    if order.through != CORE and order.jobs > 1:
        raise CheckError(f'through {order.through} one manoeuvre is driven at a time; leave out --jobs')
    settings = checked_settings(order.settings)
    if mounts_of(settings):
        raise CheckError('a suite checks one mount; leave out mount_sim.mounts')
    for node, values in settings.items():
        if values.get('sample_rate', SAMPLE_RATE) != SAMPLE_RATE:
            raise CheckError(f'a suite is judged at {SAMPLE_RATE:g} Hz; leave out {node}.sample_rate')
    trials = [
        Trial(manoeuvre, _merged(manoeuvre, settings), order.through, out, order.domain, order.priority)
        for manoeuvre in order.manoeuvres
    ]
    return [replace(trial, seconds=_checked_duration(trial)) for trial in trials]


def run_trials(trials: Sequence[Trial], jobs: int, screen: Screen, tell: Told) -> dict[str, Result]:
    """Drive all, `tell` of each when it is done, and return {manoeuvre: what came of it} in their order.

    Raises `Interrupted`.
    """
    results: dict[str, Result] = {}
    whole = sum(trial.seconds for trial in trials)
    done = 0.0
    with screen.bar('checking', transient=True) as bar:
        for trial, result in _in_core(trials, jobs) if trials[0].through == CORE else _in_turn(trials):
            done += trial.seconds
            bar(done / whole, trial.manoeuvre.name)
            results[trial.manoeuvre.name] = result
            tell(trial.manoeuvre.name, result, done / whole)
    return {trial.manoeuvre.name: results[trial.manoeuvre.name] for trial in trials}


def _in_core(trials: Sequence[Trial], jobs: int) -> Iterator[tuple[Trial, Result]]:
    """Return the trials as they are done, with what came of them."""
    for done in run_tasks(run_trial, trials, workers=jobs):
        if done.error is not None:
            raise done.error
        yield trials[done.place], done.result or broken_down(done.reason)


def _in_turn(trials: Sequence[Trial]) -> Iterator[tuple[Trial, Result]]:
    for trial in trials:
        yield trial, run_trial(trial)


def _merged(manoeuvre: Manoeuvre, settings: Settings) -> Settings:
    merged = {node: dict(values) for node, values in manoeuvre.settings.items()}
    for node, values in settings.items():
        for name, value in values.items():
            if name in merged.get(node, {}):
                raise CheckError(
                    f'{node}.{name} is set by the manoeuvre {manoeuvre.name} itself; leave it out, or give a '
                    'suite of your own with --suite'
                )
            merged.setdefault(node, {})[name] = value
    return with_control_of_mount(merged)


def _checked_duration(trial: Trial) -> float:
    """Return how long (s) a drive is, start and end of its graph included, or raise `CheckError`."""
    manoeuvre = trial.manoeuvre
    try:
        excitation = check_drive(trial.parameters, core=trial.through == CORE)
    except ParameterError as error:
        raise CheckError(f'{manoeuvre.name}: {error}') from None
    if manoeuvre.evaluated_from >= excitation.duration:
        raise CheckError(
            f'{manoeuvre.name}: evaluated_from_s ({manoeuvre.evaluated_from:g} s) must lie before the end of '
            f'the excitation ({excitation.duration:g} s)'
        )
    return excitation.start + excitation.duration + (0.0 if trial.through == CORE else _AROUND)
