"""Replay without middleware: recorded samples through the same cores as in the nodes, as function calls."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.inputs.input import Column, ControlRun, ReplayError, ReplayInput, Times
from engine_mount.drives.inputs.parameter_changes import changed
from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp, initialisation
from engine_mount.settings.chosen import Parameters, chosen_control
from mount_control.control_loop import ControlLoop, SampleCounts
from mount_control.settings import ControlSettings
from mount_init.errors import InitialisationError
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged
from mount_ros.messages.force_table import ForceTable

OFF = 0.0  # A

Progress = Callable[[float], None]


@dataclass
class ControlAnswers:
    """What the controller answered in one run: a setpoint (A) for each sample, and the traced steps."""

    stamps: Times
    setpoints: Column
    traced: NDArray[np.bool_]
    traces: NDArray[np.void]  # the policy's records, one for each sample; only where `traced`
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

    `changes` of its parameters act from the sample of their stamp on.
    """
    return ControlReplay(int(run.stamps[0]), gap, parameters, changes).answer(run.stamps, run.displacement)


class ControlReplay:
    """mount_control in one run, whose samples come in parts: the answers are those to all at once."""

    def __init__(
        self,
        first: int,
        gap: MeasuredGap,
        parameters: Parameters,
        changes: Sequence[ParametersChanged] = (),
    ):
        """Activate with `gap` before the sample of stamp `first` (ns); `changes` as for `run_control`."""
        self._begun = changed(parameters, [change for change in changes if change.time <= first])
        self._later = [change for change in changes if change.time > first]
        self._made = 0
        self._loop = loop_from(gap, self._begun, activation_before(first))

    def answer(self, stamps: Times, displacement: Column) -> ControlAnswers:
        """Return the answers to the samples that follow (ns, m); counts and refusal are those until now."""
        answers = self._loop.step_many(stamps, displacement, self._changed_in(stamps))
        refusal = self._loop.refusal and f'0 A: {self._loop.refusal}'
        return ControlAnswers(
            stamps, answers.currents, answers.traced, answers.traces, self._loop.counts, refusal
        )

    def _changed_in(self, stamps: Times) -> dict[int, list[ControlSettings]]:
        """Return the settings by the places of the samples that are the first to be answered by them."""
        found: dict[int, list[ControlSettings]] = {}
        while self._made < len(self._later) and self._later[self._made].time <= stamps[-1]:
            place = int(np.searchsorted(stamps, self._later[self._made].time))
            self._made += 1
            settings = chosen_control(changed(self._begun, self._later[: self._made]))
            found.setdefault(place, []).append(settings)
        return found


def activation_before(first: int) -> int:
    """Return the stamp (ns) by which a run is activated: 1 ms before its `first` sample (ns).

    The recording may begin long after the activation; the controller asks whether the measurements went on
    from there without a break.
    """
    return first - SAMPLE_TIME_NS


def loop_from(gap: MeasuredGap, parameters: Parameters, activation: int) -> ControlLoop:
    """Return what answers as mount_control does, activated with `gap` as of the stamp `activation` (ns)."""
    settings, loop = chosen_control(parameters), ControlLoop()
    table = settings.table(gap.table.current, gap.table.normal_force, gap.numbers['offset_current'])
    loop.note(activation)
    loop.begin(settings, table, activation)
    return loop
