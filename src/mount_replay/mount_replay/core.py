"""Replay without middleware: recorded samples through the same cores as in the nodes, as function calls."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mount_bringup.chosen import Parameters, chosen_damper, control_parameters, friction_model
from mount_control.activation import MeasurementStream
from mount_control.controller import TRACE, ControlLaw, Controller
from mount_control.force_to_current import CurrentTable, resample
from mount_control.parameters import SAMPLE_TIME, ControlParameters
from mount_control.sample_watch import Judgement, SampleCounts, SampleWatch
from mount_init.errors import InitialisationError
from mount_models.damper import DamperCurve
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_replay.given.input import Column, ControlRun, ReplayError, ReplayInput, Times
from mount_replay.given.parameter_changes import changed
from mount_replay.given.ramps import MeasuredGap, Ramp, initialisation
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged
from mount_ros.messages.force_table import ForceTable

OFF = 0.0  # A
_PERIOD = round(SAMPLE_TIME * 1e9)  # ns

Progress = Callable[[float], None]


@dataclass
class ControlAnswers:
    """What the controller answered in one run: a setpoint (A) for each sample, and the traced steps."""

    stamps: Times
    setpoints: Column
    traced: NDArray[np.bool_]
    traces: NDArray[np.void]  # `TRACE`, one for each sample; only where `traced`
    counts: SampleCounts
    refusal: str = ''  # why the table did not hold until the end, or empty


@dataclass
class RampAnswers:
    """The setpoints (A) of one initialisation and its result."""

    stamps: Times
    setpoints: Column
    gap: MeasuredGap


@dataclass
class Replayed:
    """The answers in the order of the parts that were replayed; times in s."""

    parts: list[RampAnswers | ControlAnswers] = field(default_factory=list)
    gaps: list[MeasuredGap] = field(default_factory=list)  # with which each run of the controller began
    wall_time: float = 0.0
    control_time: float = 0.0  # share of the runs of the controller

    @property
    def runs(self) -> list[ControlAnswers]:
        """The answers of the controller."""
        return [part for part in self.parts if isinstance(part, ControlAnswers)]

    @property
    def ramps(self) -> list[RampAnswers]:
        """The answers of the initialisation."""
        return [part for part in self.parts if isinstance(part, RampAnswers)]


def replay_in_core(given: ReplayInput, parameters: Parameters) -> Replayed:
    """Replay all parts with these parameters of the nodes; raises a `ValueError` where one is refused."""
    replayed = Replayed()
    begin = time.perf_counter()
    result: MeasuredGap | None = None
    for part in given.parts:
        if isinstance(part, Ramp):
            answers = run_ramp(part, parameters)
            result = answers.gap
            replayed.parts.append(answers)
            continue
        gap = result if result is not None and result.stamp == part.gap.stamp else part.gap
        part_begin = time.perf_counter()
        replayed.parts.append(run_control(part, gap, parameters, given.changes))
        replayed.control_time += time.perf_counter() - part_begin
        replayed.gaps.append(gap)
    replayed.wall_time = time.perf_counter() - begin
    return replayed


def run_ramp(ramp: Ramp, parameters: Parameters) -> RampAnswers:
    """Return setpoints and result of an initialisation from its recorded samples."""
    core = initialisation({node: dict(values) for node, values in parameters.items()}, ramp.temperatures)
    setpoints = np.array([core.step(*sample) for sample in ramp.samples()])
    try:
        result = core.result()
    except InitialisationError as error:
        raise ReplayError(f'with these settings mount_init would have refused to start: {error}') from None
    assert core.last_stamp is not None
    numbers = {name: float(getattr(result, name)) for name in topics.AIR_GAP.names}
    table = ForceTable(core.last_stamp, result.table[0], result.table[1])
    return RampAnswers(ramp.stamps, setpoints, MeasuredGap(core.last_stamp, numbers, table))


def run_control(
    run: ControlRun, gap: MeasuredGap, parameters: Parameters, changes: Sequence[ParametersChanged] = ()
) -> ControlAnswers:
    """Return what mount_control answers to the samples of a run, activated with `gap`.

    Samples that follow each other regularly pass the compiled controller at once; all others are
    judged one by one, as in the node. `changes` of its parameters act from the sample of their stamp on.
    """
    begun = changed(parameters, [change for change in changes if change.time <= run.stamps[0]])
    laws = _laws(run, gap, begun, [change for change in changes if change.time > run.stamps[0]])
    settings = control_parameters(begun)
    controller = controller_for(gap, begun)
    watch = SampleWatch(SAMPLE_TIME, settings.longest_bridge, settings.displacement_range)
    stream = MeasurementStream(gap.stamp, max(gap.stamp, int(run.stamps[0])))
    count = len(run.stamps)
    answers = ControlAnswers(
        run.stamps, np.zeros(count), np.zeros(count, bool), np.zeros(count, TRACE), watch.counts
    )
    doubtful = sorted({*np.flatnonzero(~_follows(run, settings)).tolist(), *laws})
    for begin, end in zip(doubtful, [*doubtful[1:], count], strict=True):
        stamp, displacement = int(run.stamps[begin]), float(run.displacement[begin])
        stream.note(stamp)
        if not stream.holds(gap.stamp):
            answers.refusal = 'the measurements were interrupted for more than 1 s: 0 A from there on'
            break
        judgement, missing = watch.judge(stamp, displacement)
        if judgement in (Judgement.INVALID, Judgement.IGNORE):
            continue
        for law in laws.get(begin, ()):
            controller.change(law)
        if judgement is Judgement.RESTART:
            controller.restart(displacement)
        controller.step(displacement, missing)
        answers.traces[begin] = controller.trace
        if end > begin + 1:
            controller.run(run.displacement[begin + 1 : end], answers.traces[begin + 1 : end])
            watch.follow(int(run.stamps[end - 1]), end - begin - 1)
            stream.last = watch.last_stamp
        answers.traced[begin:end] = True
    answers.setpoints[answers.traced] = answers.traces['current'][answers.traced]
    return answers


def controller_for(gap: MeasuredGap, parameters: Parameters) -> Controller:
    """Return the controller that mount_control makes when it is activated with `gap`."""
    return Controller(*_ingredients(gap, parameters))


def _ingredients(
    gap: MeasuredGap, parameters: Parameters
) -> tuple[ControlParameters, DamperCurve, FrictionCoefficients, FrictionContact, CurrentTable]:
    settings = control_parameters(parameters)
    table = resample(
        gap.table.current, gap.table.normal_force, gap.numbers['offset_current'], settings.highest_current
    )
    return settings, chosen_damper(parameters), *friction_model(parameters), table


def _laws(
    run: ControlRun, gap: MeasuredGap, parameters: Parameters, changes: Sequence[ParametersChanged]
) -> dict[int, list[ControlLaw]]:
    """Return the laws by the places of the samples that are the first to be answered by them."""
    laws: dict[int, list[ControlLaw]] = {}
    for count, change in enumerate(changes, 1):
        place = int(np.searchsorted(run.stamps, change.time))
        if place < len(run.stamps):
            law = ControlLaw(*_ingredients(gap, changed(parameters, changes[:count])))
            laws.setdefault(place, []).append(law)
    return laws


def _follows(run: ControlRun, settings: ControlParameters) -> NDArray[np.bool_]:
    """Return which samples are valid and stand one period after a valid one."""
    valid = np.abs(run.displacement) <= settings.displacement_range  # not so for NaN
    follows = np.zeros(len(run.stamps), bool)
    steps = np.diff(run.stamps)
    follows[1:] = valid[1:] & valid[:-1] & (steps > 0) & (steps < _PERIOD + _PERIOD // 2)
    return follows
