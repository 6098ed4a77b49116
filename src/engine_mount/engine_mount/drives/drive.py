"""Simulated drives: an order checked whole, driven in core or through the nodes, and recorded."""

import contextlib
import io
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from engine_mount.drives.external_excitation import FOLDER, ExternalExcitation
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import CoreChain
from engine_mount.recordings.screen import Screen
from engine_mount.settings.chosen import Parameters, check_effect
from engine_mount.settings.options import checked_recorder, mounts_of, settings_of_mounts, with_sample_rate
from engine_mount.settings.run_folder import RunFolder, make_run_folder
from engine_mount.signals.excitation import build_excitation
from mount_bringup.graph.domain import chosen_domain
from mount_bringup.graph.nodes import RESTART_LIMIT, SIM, GraphError, GraphSettings, Grouping
from mount_bringup.settings import check_sample_rate, checked_settings
from mount_control.controller import FAULT_SENTENCE
from mount_control.policy.registry import DEFAULT
from mount_driver.parameters import DriverParameters
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.parameters import RecorderParameters
from mount_recorder.session import new_session, session_text
from mount_sim.electronics.faults import check_without_bus, told_faults
from mount_sim.excitation.excitation import Excitation, steps_of_sample
from mount_sim.parameters import SimParameters
from mount_sim.plant.car import checked_plant
from mount_sim.plant.closing import checked_closing
from mount_sim.plant.mounts import check_control_of_mount, with_control_of_mount
from mount_sim.plant.simulated_car import SimulatedCar, beyond_range_sentence, mount_parameters

CORE, LOCKSTEP, REAL_TIME = 'core', 'lock-step', 'real time'
_DEFAULT_SCENARIO = 'motorway'


class CombinationError(ValueError):
    """Arguments of a drive that do not go together; the text names both."""


@dataclass(frozen=True)
class Drive:
    """A recorded drive; times in s, NaN where they are unknown.

    `excitation_start` is the time of the first sample with excitation, latencies are those from a frame of
    the electronics to its answer in real time. `complaints` are sentences: what was not as it should be.
    """

    folder: RunFolder
    scenario: str
    mode: str
    parameters: dict[str, dict[str, Any]]
    samples: int
    excitation_start: float
    real_time_factor: float
    latency_median: float = math.nan
    latency_p99: float = math.nan
    restarts: Sequence[Any] = ()
    complaints: list[str] = field(default_factory=list)

    @property
    def recording(self) -> Path:
        """The recording of the drive."""
        return self.folder.recording

    @property
    def figures(self) -> dict[str, Any]:
        """The figures of the run as JSON has them."""
        return {
            'scenario': self.scenario,
            'mode': self.mode,
            'samples': self.samples,
            'excitation_start': self.excitation_start,
            'real_time_factor': self.real_time_factor,
            'latency_median_s': self.latency_median,
            'latency_p99_s': self.latency_p99,
            'restarts': self.restarts,
        }

    def sentences(self) -> list[str]:
        """Return how the run went, in words."""
        speed = f'{self.real_time_factor:.1f} x real time'
        return [
            f'{self.scenario}, {self.mode}: {self.samples} samples, {speed}',
            *self.complaints,
            f'recording {self.recording}',
        ]


def drive(
    *,
    core: bool = False,
    lockstep: bool = False,
    apart: bool = False,
    composed: bool = False,
    scenario: str = '',
    mount: str = '',
    mounts: str = '',
    duration: float | None = None,
    sample_rate: float | None = None,
    seed: int | None = None,
    faults: Sequence[str] = (),
    parameters: Parameters | None = None,
    excitation: ExternalExcitation | None = None,
    out: str | os.PathLike[str] | None = None,
    domain: int | None = None,
    namespace: str = '',
    priority: int = 10,
    restarts: int = RESTART_LIMIT,
    screen: Screen | None = None,
) -> Drive:
    """Drive a simulated car and record it: in core, in lock-step or, without either, in real time.

    The scenario is that of `excitation` (a foreign file), by default the motorway; `duration` in s,
    `sample_rate` in Hz, `faults` as `NAME@t[:duration]`, `parameters` {node: {parameter: value}}. `mounts`
    are names such as `left,right`. The folder `out` (by default a new one below `bags`) takes recording and
    logs. In lock-step each node has a process of its own if it stands `apart`; in real time driver,
    initialisation and control share one if `composed`; `priority` is that of the 1 kHz loop where permitted,
    `restarts` how often a node may fail within a minute. `screen` shows what happens.

    Raises `CombinationError`, another `ValueError` with the reason, `GraphError` or `Interrupted`.
    """
    if core and lockstep:
        raise CombinationError('choose --lockstep or --core, not both')
    if apart and not lockstep:
        raise CombinationError('--apart goes with --lockstep: in real time every node has its own process')
    if composed and (lockstep or core):
        raise CombinationError('--composed is for real time: in lock-step the nodes share a process anyway')
    mode = CORE if core else LOCKSTEP if lockstep else REAL_TIME
    screen, domain = screen or Screen(io.StringIO()), chosen_domain(domain)
    values = {node: dict(own) for node, own in (parameters or {}).items()}
    sim = values.setdefault(SIM.name, {})
    scenario = _scenario(scenario, sim, excitation)
    options = {
        'mount': mount or None, 'mounts': mounts or None, 'seed': seed, 'timeline.duration': duration,
    }  # fmt: skip
    sim |= {'scenario': scenario, **{name: value for name, value in options.items() if value is not None}}
    if faults:
        sim['faults'] = [*sim.get('faults', []), *faults]
    values = with_control_of_mount(with_sample_rate(checked_settings(values), sample_rate))
    with tempfile.TemporaryDirectory() as scratch:
        checked = check_drive(_with_file(values, excitation, Path(scratch)), core=core)
    for remark in (*(excitation.notes if excitation else ()), *checked.notes):
        screen.note(remark)
    if not core:  # loads the middleware; where there is none, nothing is written
        from engine_mount.drives.graph_drive import drive_graph
    folder = make_run_folder(Path(out) if out is not None else None, scenario)
    values = _with_file(values, excitation, folder.path / FOLDER)
    session = partial(_session, scenario, mode, values, excitation)
    separate = Grouping.COMPOSED if composed else Grouping.APART
    settings = GraphSettings(
        namespace=namespace,
        domain=domain,
        parameters=values,
        grouping=Grouping.TOGETHER if lockstep and not apart else separate,
        priority=0 if lockstep else priority,
        restart_limit=restarts,
    )
    with report_early_end(folder, screen):
        if core:
            figures, complaints = _drive_core(values, checked, folder, session, namespace, screen), []
        else:
            figures, complaints = drive_graph(settings, checked, folder, session, screen, lockstep=lockstep)
    beyond, first = figures.pop('beyond_range'), figures.pop('first_beyond_range')
    control_faults = figures.pop('control_faults')
    if control_faults:
        complaints.insert(0, f'{FAULT_SENTENCE} (times: {control_faults})')
    if beyond:
        complaints.insert(0, beyond_range_sentence(beyond, first))
    return Drive(folder, scenario, mode, values, complaints=complaints, **figures)


@contextlib.contextmanager
def report_early_end(folder: RunFolder, screen: Screen) -> Iterator[None]:
    """Name the recording of a drive that ends early; a `ValueError` is then no wrong use: a `GraphError`."""
    try:
        yield
    except BaseException as error:  # however it ends
        if folder.recording.exists():
            screen.say(f'recording  {folder.recording}')
        if isinstance(error, ValueError):
            raise GraphError(str(error)) from error
        raise


def check_drive(parameters: Parameters, *, core: bool = False) -> Excitation:
    """Return the excitation of a drive; raises the `ValueError` with which a node would refuse its part."""
    values = parameters.get(SIM.name, {})
    excitation = build_excitation(mount_parameters(values))
    for own in settings_of_mounts(parameters).values():
        sim = with_flattened(SimParameters(), own.get(SIM.name, {}))
        told_faults(sim.faults)
        if core:
            check_without_bus(sim.faults)
        check_sample_rate(own)
        steps_of_sample(sim.sample_rate, excitation.step_time)
        check_control_of_mount(own)
        check_effect(own.get('mount_control', {}))
        checked_closing(sim.mechanics, sim.actuator)
        checked_plant(sim.plant, excitation.seat, excitation.step_time)
        with_flattened(DriverParameters(), own.get('mount_driver', {}))
        CoreChain(own)
    if mounts_of(parameters):
        SimulatedCar(values, excitation)
    checked_recorder(parameters.get('mount_recorder', {}))
    return excitation


def parameters_of_session(parameters: Parameters) -> dict[str, dict[str, Any]]:
    """Return the parameters as the session of a drive names them."""
    named = {node: dict(values) for node, values in parameters.items()}
    # where these are not named, a recording is an older one
    named['mount_control'] = {'policy': DEFAULT, 'sample_rate': SAMPLE_RATE, **named.get('mount_control', {})}
    return named


def _scenario(named: str, sim: Mapping[str, Any], excitation: ExternalExcitation | None) -> str:
    """Return the scenario: that of the file, else the one named; raises `CombinationError` for two."""
    named = named or str(sim.get('scenario', ''))
    if excitation is None:
        return named or _DEFAULT_SCENARIO
    if named not in ('', excitation.scenario):
        raise CombinationError(
            f'the file is driven as scenario {excitation.scenario}; leave out --scenario {named}, or the file'
        )
    return excitation.scenario


def _with_file(
    parameters: Parameters, excitation: ExternalExcitation | None, folder: Path
) -> dict[str, dict[str, Any]]:
    """Return the parameters with those of the file of `excitation`, written into `folder`."""
    completed = {node: dict(values) for node, values in parameters.items()}
    if excitation is not None:
        completed[SIM.name] |= excitation.parameters(folder)
    return completed


def _drive_core(
    parameters: Parameters,
    excitation: Excitation,
    folder: RunFolder,
    session: Callable[[Parameters], str],
    namespace: str,
    screen: Screen,
) -> dict[str, Any]:
    """Drive in core; return the figures of the run."""
    sessions = {name: session(settings) for name, settings in settings_of_mounts(parameters).items()}
    recorder = with_flattened(RecorderParameters(), parameters.get('mount_recorder', {}))
    with screen.bar('driving (core)') as show:
        outcome = record_core(
            folder.recording,
            parameters,
            sessions,
            show,
            excitation=excitation,
            namespace=namespace,
            split_size=recorder.split_size,
        )
    return {
        'samples': outcome.samples,
        'excitation_start': outcome.excitation_start,
        'real_time_factor': outcome.simulated / outcome.wall_time,
        'beyond_range': outcome.beyond_range.samples,
        'first_beyond_range': outcome.beyond_range.first,
        'control_faults': outcome.control_faults,
    }


def _session(
    scenario: str,
    mode: str,
    ordered: Parameters,
    excitation: ExternalExcitation | None,
    parameters: Parameters,
) -> str:
    """Return the session text of a mount whose nodes have `parameters`."""
    named = parameters_of_session(parameters)
    # the files that the order names, not the array that is made of them
    read = {name: value for name, value in ordered.get(SIM.name, {}).items() if _names_input(name)}
    others = {name: value for name, value in named.get(SIM.name, {}).items() if not _names_input(name)}
    named[SIM.name] = {**others, **read}
    content: dict[str, Any] = {'scenario': scenario, 'mode': mode, 'parameters': named}
    if excitation is not None:
        content['given'] = excitation.provenance(ordered[SIM.name][excitation.parameter])
    return session_text(new_session(content))


def _names_input(name: str) -> bool:
    return name.startswith(('recorded.', 'road.'))
