"""Replay without middleware: recorded samples through the same cores as in the nodes, as function calls."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.inputs.consumed_samples import (
    Column,
    MeasuredGap,
    Ramp,
    ReplayError,
    Times,
)
from engine_mount.drives.inputs.input import ReplayInput, with_recorded_changes
from engine_mount.settings.chosen import Parameters, chosen_control, chosen_initialisation
from mount_control.control_loop import ControlLoop, SampleCounts
from mount_control.settings import ControlSettings
from mount_init.errors import InitialisationError
from mount_init.estimate import TemperatureReadings
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged
from mount_ros.messages.force_table import ForceTable

OFF = 0.0  # A


@dataclass
class ControlAnswers:
    """The answers of the controller in one run: a setpoint (A) for each sample, and the traced steps.

    `traces` are records of the policy, one for each sample, valid where `traced`. `refusal`: why the table
    did not hold until the end, or empty.
    """

    stamps: Times
    setpoints: Column
    traced: NDArray[np.bool_]
    traces: NDArray[np.void]
    counts: SampleCounts
    refusal: str = ''


@dataclass
class RampAnswers:
    """The setpoints (A) of one initialisation and its result."""

    stamps: Times
    setpoints: Column
    gap: MeasuredGap


@dataclass
class Replayed:
    """The answers in the order of the parts that were replayed, and the gap with which each run began.

    `control_time` (s) is the time that the runs of the controller took.
    """

    parts: list[RampAnswers | ControlAnswers] = field(default_factory=list)
    gaps: list[MeasuredGap] = field(default_factory=list)
    control_time: float = 0.0

    @property
    def runs(self) -> list[ControlAnswers]:
        """The answers of the controller."""
        return [part for part in self.parts if isinstance(part, ControlAnswers)]

    @property
    def ramps(self) -> list[RampAnswers]:
        """The answers of the initialisation."""
        return [part for part in self.parts if isinstance(part, RampAnswers)]


def replay_in_core(given: ReplayInput, parameters: Parameters) -> Replayed:
    """Replay all parts with these parameters of the nodes; raises a `ValueError` where one is refused.

    A run begins with the gap that the replayed initialisation before it has measured.
    """
    replayed = Replayed()
    measured: MeasuredGap | None = None
    for part in given.parts:
        if isinstance(part, Ramp):
            ramp = run_ramp(part, parameters)
            measured = ramp.gap
            replayed.parts.append(ramp)
            continue
        gap = measured if measured is not None and measured.stamp == part.gap.stamp else part.gap
        begin = time.perf_counter()
        replay = ControlReplay(int(part.stamps[0]), gap, parameters, given.changes)
        replayed.parts.append(replay.answer(part.stamps, part.displacement, part.crank_frequency))
        replayed.control_time += time.perf_counter() - begin
        replayed.gaps.append(gap)
    return replayed


def run_ramp(ramp: Ramp, parameters: Parameters) -> RampAnswers:
    """Return setpoints and result of an initialisation from its recorded samples."""
    readings = TemperatureReadings()
    for stamp, celsius in ramp.temperatures:
        readings.take(stamp, celsius)
    core = chosen_initialisation(parameters, readings)
    setpoints = np.array([core.step(*sample) for sample in ramp.samples()])
    try:
        result = core.result()
    except InitialisationError as error:
        raise ReplayError(f'with these settings mount_init would have refused to start: {error}') from None
    numbers = {name: float(getattr(result, name)) for name in topics.AIR_GAP.names}
    table = ForceTable(core.stamps[-1], result.table[0], result.table[1])
    return RampAnswers(ramp.stamps, setpoints, MeasuredGap(core.stamps[-1], numbers, table))


class ControlReplay:
    """mount_control in one run, whose samples come in parts: the answers are those to all at once."""

    def __init__(
        self,
        first: int,
        gap: MeasuredGap,
        parameters: Parameters,
        changes: Sequence[ParametersChanged] = (),
    ):
        """Activate with `gap` before the sample of stamp `first` (ns).

        `changes` of its parameters act from the sample of their stamp on.
        """
        begun = with_recorded_changes(parameters, [change for change in changes if change.time <= first])
        later = [change for change in changes if change.time > first]
        self._later = [
            (change.time, chosen_control(with_recorded_changes(begun, later[: number + 1])))
            for number, change in enumerate(later)
        ]
        settings, activation = chosen_control(begun), activation_before(first)
        table = settings.table(gap.table.current, gap.table.normal_force, gap.numbers['offset_current'])
        self._loop = ControlLoop()
        self._loop.note(activation)
        self._loop.begin(settings, table, activation)

    def answer(self, stamps: Times, displacement: Column, crank_frequency: Column) -> ControlAnswers:
        """Return the answers to the samples that follow (ns, m, Hz); counts and refusal: until now."""
        changes: dict[int, list[ControlSettings]] = {}
        while self._later and self._later[0][0] <= stamps[-1]:
            time_of_change, settings = self._later.pop(0)
            changes.setdefault(int(np.searchsorted(stamps, time_of_change)), []).append(settings)
        answers = self._loop.step_many(stamps, displacement, changes, crank_frequency)
        refusal = self._loop.refusal and f'0 A: {self._loop.refusal}'
        return ControlAnswers(
            stamps, answers.currents, answers.traced, answers.traces, self._loop.counts, refusal
        )


def activation_before(first: int) -> int:
    """Return the stamp (ns) by which a run is activated: 1 ms before its `first` sample (ns).

    The recording may begin long after the activation; the controller checks whether the measurements went
    on from there without a break.
    """
    return first - SAMPLE_TIME_NS
