"""One manoeuvre driven, beside it hydromount and undamped mount on the same excitation, and its figures."""

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.drives.drive import DriveOrder, record_drive
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.check.evaluation import Beside, Driven, figures_of
from engine_mount.experiments.check.suite import Manoeuvre
from engine_mount.experiments.sensitivity.grid import TruthOnly
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import Losses, losses
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.drive.evaluation import samples_at_the_ends
from engine_mount.reports.drive.signals import FloatArray, Truth, load_drive
from mount_bringup.graph.nodes import GraphError
from mount_models.sampling import SAMPLE_TIME

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
    parameters: Mapping[str, Mapping[str, Any]]
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


def run_trial(trial: Trial, screen: Screen | None = None) -> Result:
    """Drive one manoeuvre and return what came of it; raises `Interrupted`. `screen` is told of the drive.

    One that breaks down, or whose recording cannot be judged, is `broken_down`: the others go on.
    """
    order = DriveOrder(
        scenario=str(trial.parameters['mount_sim']['scenario']),
        mode=MODES[trial.through],
        parameters={node: dict(values) for node, values in trial.parameters.items()},
        domain=trial.domain,
        out=trial.out / trial.manoeuvre.name,
        priority=trial.priority,
    )
    try:
        folder, run, complaints = record_drive(order, screen or Screen(io.StringIO()))
        return _result(trial, open_recording(folder.recording), run, complaints)
    except (GraphError, ValueError) as error:
        return broken_down(str(error))


def broken_down(reason: str) -> Result:
    """Return the result of a manoeuvre of which no figure is known."""
    return Result({}, (), Shown(), reason)


def _result(trial: Trial, recording: Recording, run: dict[str, Any], complaints: list[str]) -> Result:
    audits = audit(recording)
    found = losses(recording, audits)
    remarks = [*complaints, *recording.warnings, *samples_at_the_ends(recording, audits, run['samples'])]
    beside = {other: _alone(trial.parameters, mount) for other, mount in MOUNT_OF.items()}
    drive = load_drive(recording, float(run['excitation_start']))
    remarks += _late_control(recording, drive.zero)
    truth = at_samples(drive.truth, beside['undamped'].displacement.size)
    driven = Driven(drive, truth, trial.parameters)
    figures = {
        **figures_of(driven, beside, trial.manoeuvre),
        **_gap_errors(recording),
        **_of_losses(found),
        'remarks': float(len(remarks)),
        'latency_p99_us': 1e6 * run['latency_p99_s'] if trial.through == GRAPH else math.nan,
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


def _alone(parameters: Mapping[str, Mapping[str, Any]], mount: str) -> Beside:
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
