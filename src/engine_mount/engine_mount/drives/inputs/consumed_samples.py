"""Which samples the controller has consumed, in runs from one activation to the next.

In real time a message can be recorded and yet come too late for the controller, which then bridged it.
Whether it did stands in `control_trace`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_control.settings import ControlParameters, policy_parameters
from mount_models.sampling import sample_time_ns
from mount_ros import topics
from mount_ros.messages.force_table import ForceTable, table_message
from mount_ros.messages.scalars import ScalarsLayout

Times = NDArray[np.int64]
Column = NDArray[np.float64]

SECOND = 1_000_000_000  # ns
BREAK = SECOND
"""ns: after it the controller takes no table from before."""
QUIET_AT_FIRST = ('velocity', 'friction_deflection', 'bridged_samples')
"""Fields of a trace that are 0 in the first step of an empty memory, of every policy."""
_LENGTHS = ('m', 'm/s')  # units of a policy's own fields that are 0 in its first step


class ReplayError(ValueError):
    """A recording cannot be replayed as ordered; the text says why and what would help."""


class Notes(list[str]):
    """Sentences on what is not as one would expect; `zero` is the stamp (ns) from which times are counted."""

    def __init__(self, zero: int = 0):
        super().__init__()
        self.zero = zero

    def at(self, stamp: int) -> str:
        """Return the time of a stamp (ns), in words."""
        return f'{(stamp - self.zero) / SECOND:.3f} s'


@dataclass(frozen=True)
class MeasuredGap:
    """The result of one initialisation as its two messages carry it; `stamp` (ns) names the activation.

    `numbers` are those of the topic air_gap.
    """

    stamp: int
    numbers: dict[str, float]
    table: ForceTable

    def dated(self, stamp: int) -> 'MeasuredGap':
        """Return the same result as of another time (ns)."""
        return MeasuredGap(stamp, self.numbers, self.table._replace(stamp=stamp))

    def messages(self) -> tuple[bytes, bytes]:
        """Return the messages of air_gap and current_force_table."""
        layout = ScalarsLayout(topics.AIR_GAP)
        table = np.stack([self.table.current, self.table.normal_force])
        return (
            layout.pack(self.stamp, [self.numbers[name] for name in layout.names]),
            table_message(self.stamp, table),
        )


@dataclass(frozen=True)
class Ramp:
    """The ripple samples that one initialisation took: stamps ns, A, A/s, T/s.

    `temperatures` are the coil temperatures (stamp ns, degC) up to its end; none in older recordings.
    """

    stamps: Times
    coil_current: Column
    current_rate: Column
    flux_rate: Column
    temperatures: tuple[tuple[int, float], ...] = ()

    def samples(self) -> Iterator[tuple[int, float, float, float]]:
        """Return the samples one by one, as an initialisation takes them."""
        columns = (self.stamps, self.coil_current, self.current_rate, self.flux_rate)
        return zip(*(column.tolist() for column in columns), strict=True)


@dataclass(frozen=True)
class ControlRun:
    """The displacement samples that mount_control took from one activation to its end, stamps rising.

    `crank_frequency`: what it knew of the engine at each, 0 where nothing is recorded. `gap` is what it was
    activated with; `from_its_beginning` whether the first sample is the first that it ever took, so that its
    memory was empty.
    """

    stamps: Times  # ns
    displacement: Column  # m
    crank_frequency: Column  # Hz
    gap: MeasuredGap
    from_its_beginning: bool = True


@dataclass(frozen=True)
class RecordedAnswers:
    """The recorded answers of the controller by stamp (ns), rising: currents in A, traces of its steps."""

    stamps: Times
    currents: Column
    trace_stamps: Times
    traces: dict[str, Column]
    quiet_at_first: tuple[str, ...] = QUIET_AT_FIRST

    @cached_property
    def afresh(self) -> NDArray[np.bool_]:
        """Which recorded steps may be the first of an empty memory: nothing moves in it yet."""
        quiet = np.ones(len(self.trace_stamps), bool)
        for name in self.quiet_at_first:
            quiet &= self.traces[name] == 0.0 if name in self.traces else True
        return quiet

    def step(self, stamp: int) -> tuple[int, bool]:
        """Return the place of the first step at `stamp` (ns) or later, and whether it is of that stamp."""
        step = int(np.searchsorted(self.trace_stamps, stamp))
        return step, step < len(self.trace_stamps) and int(self.trace_stamps[step]) == stamp


def quiet_at_first(control: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the fields that are 0 in the first step of an empty memory; `control`: of mount_control."""
    own = policy_parameters(control)[0].TRACE
    return (*QUIET_AT_FIRST, *(name for name, unit in own.items() if unit in _LENGTHS))


def control_runs(
    displacement: tuple[Times, Column],
    answers: RecordedAnswers | None,
    ramps: Sequence[Ramp],
    gaps: Sequence[MeasuredGap],
    control: ControlParameters,
    notes: Notes,
) -> list[ControlRun]:
    """Return the runs of the controller with the samples that it took; `displacement`: stamps (ns), m."""
    period = sample_time_ns(control.sample_rate)
    stamps, values = _consumed(displacement, answers, ramps, gaps, period, notes)
    if not len(stamps):
        return []
    frequencies = _crank_frequency(stamps, answers)
    steps = set((np.flatnonzero(np.diff(stamps) > 1.5 * period) + 1).tolist())
    if answers is not None:  # in lock-step an activation takes no time
        moved_before = np.concatenate([[False], answers.afresh])[: len(answers.afresh)]
        begins_again = answers.trace_stamps[answers.afresh & ~moved_before]
        steps |= set(np.searchsorted(stamps, begins_again).tolist())
    begins = [0]
    for place in sorted(steps - {0, len(stamps)}):
        between = int(stamps[place - 1]), int(stamps[place])
        if _was_activated(*between, displacement[0], answers, gaps, control.longest_bridge):
            begins.append(place)
    runs = []
    for begin, end in zip(begins, [*begins[1:], len(stamps)], strict=True):
        earlier = [gap for gap in gaps if gap.stamp < stamps[begin]]
        whole = begin > 0 or answers is None
        if answers is not None and not whole:  # its first step is not in the recording, or of an empty memory
            whole = bool(answers.afresh[answers.step(int(stamps[begin]))[0] :][:1].all())
        if not whole:
            notes.append(
                f'the recording begins while the controller is at work, at {notes.at(int(stamps[begin]))}: '
                'what it remembered is not in it, so the replay starts afresh there'
            )
        part = slice(begin, end)
        of_run = stamps[part], values[part], frequencies[part]
        runs.append(ControlRun(*of_run, (earlier or gaps[:1])[-1], whole))
    return runs


def _crank_frequency(stamps: Times, answers: RecordedAnswers | None) -> Column:
    """Return what each sample's step knew of the engine (Hz), of the next step where its trace is lost."""
    if answers is None or not len(answers.traces.get('crank_frequency', ())):
        return np.zeros(len(stamps))  # older recordings have no such field
    return answers.traces['crank_frequency'][places_in(answers.trace_stamps, stamps)[1]]


def _consumed(
    displacement: tuple[Times, Column],
    answers: RecordedAnswers | None,
    ramps: Sequence[Ramp],
    gaps: Sequence[MeasuredGap],
    period: int,
    notes: Notes,
) -> tuple[Times, Column]:
    """Return the samples (stamps ns, displacement m) that the controller has taken, in all its runs.

    A sample that the recorder lost has the displacement of its trace.
    """
    stamps, values = displacement
    answered = np.empty(0, np.int64) if answers is None else _answered(answers, ramps, gaps, period, notes)
    if answers is None or not answered.size:
        if answers is not None:
            notes.append('the controller was not active in this recording: it starts after the air_gap here')
        after = stamps > gaps[0].stamp
        return stamps[after], values[after]
    consumed = _union(answered, _taken_without_answer(stamps, answered, answers, period, notes))
    inside = stamps[(stamps >= consumed[0]) & (stamps <= consumed[-1])]
    late = inside[~places_in(consumed, inside)[0]]
    if late.size:
        notes.append(
            f'{late.size} recorded samples did not reach the controller in time, the first at '
            f'{notes.at(int(late[0]))}: left out, as in the drive'
        )
    found, column = looked_up(consumed, stamps, values)
    if not found.all() and 'displacement' in answers.traces:
        traced, of_trace = looked_up(consumed, answers.trace_stamps, answers.traces['displacement'])
        filled = traced & ~found
        column[filled] = of_trace[filled]
        found |= filled
        count = np.count_nonzero(filled)
        notes.append(f'{count} samples that the recorder lost are taken from control_trace')
    if not found.all():
        notes.append(
            f'{np.count_nonzero(~found)} answers, the first at {notes.at(int(consumed[~found][0]))}, have no '
            'recorded displacement; they cannot be replayed'
        )
    return consumed[found], column[found]


def _answered(
    answers: RecordedAnswers, ramps: Sequence[Ramp], gaps: Sequence[MeasuredGap], period: int, notes: Notes
) -> Times:
    """Return the stamps of the samples with a setpoint or a trace of mount_control.

    Without the setpoints of a ramp that was given up, which no step of the controller explains: without a
    trace the controller only answers 0 A, and a few answers whose trace was not recorded.
    """
    traces, setpoints = answers.trace_stamps, answers.stamps
    by_init = np.sort(np.concatenate([np.empty(0, np.int64), *(ramp.stamps for ramp in ramps)]))
    setpoints = setpoints[~places_in(by_init, setpoints)[0]]
    beginning = min(gaps[0].stamp, int(traces[0]) - 1) if traces.size else gaps[0].stamp
    answered = _union(setpoints, traces)
    answered = answered[answered > beginning]
    if not traces.size:
        return answered
    odd = ~places_in(traces, answered)[0] & (looked_up(answered, answers.stamps, answers.currents)[1] != 0.0)
    places = np.searchsorted(traces, answered[odd])
    bounds = np.concatenate([[-(1 << 62)], traces, [1 << 62]])
    # a shorter hole in the traces is one of the recording, not another speaker
    foreign = answered[odd][bounds[places + 1] - bounds[places] > 20 * period]
    if foreign.size:
        notes.append(
            f'{foreign.size} setpoints from {notes.at(int(foreign[0]))} to {notes.at(int(foreign[-1]))} are '
            'of no step of the controller and of no complete initialisation (a ramp that was given up?): '
            'not replayed'
        )
    return answered[~places_in(foreign, answered)[0]]


def _taken_without_answer(
    stamps: Times, answered: Times, answers: RecordedAnswers, period: int, notes: Notes
) -> Times:
    """Return the samples whose answers were not recorded although the next step did not bridge them."""
    found = [np.empty(0, np.int64)]
    for place in np.flatnonzero(np.diff(answered) > 1.5 * period):
        before, after = int(answered[place]), int(answered[place + 1])
        step, traced = answers.step(after)
        if traced and not answers.afresh[step]:
            last_taken = after - (answers.traces['bridged_samples'][step] + 0.5) * period
            found.append(stamps[(stamps > before) & (stamps < last_taken)])
    silent = np.concatenate(found)
    if silent.size:
        notes.append(f'the answers to {silent.size} samples are missing in the recording; they are replayed')
    return silent


def _was_activated(
    before: int,
    after: int,
    all_stamps: Times,
    answers: RecordedAnswers | None,
    gaps: Sequence[MeasuredGap],
    longest_bridge: float,
) -> bool:
    """Whether mount_control was activated anew between two samples that it took one after the other."""
    if answers is not None:
        step, traced = answers.step(after)
        if traced and not answers.afresh[step]:
            return False
        if traced and after - before <= longest_bridge * SECOND:
            return True
    if any(before <= gap.stamp < after for gap in gaps):
        return True
    # Without samples for so long a controller discards its table; with samples and no answers it is off.
    there = all_stamps[(all_stamps >= before) & (all_stamps <= after)]
    return after - before > BREAK and there.size > 1 and bool(np.diff(there).max() <= BREAK)


# Rows of rising stamps looked up in one another.


def looked_up(wanted: Times, stamps: Times, values: Column) -> tuple[NDArray[np.bool_], Column]:
    """Return whether each wanted stamp is there, and its value, NaN where it is not."""
    if not len(stamps):
        return np.zeros(len(wanted), bool), np.full(len(wanted), np.nan)
    found, places = places_in(stamps, wanted)
    return found, np.where(found, values[places], np.nan)


def places_in(stamps: Times, wanted: Times) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return whether each of `wanted` is among `stamps`, and its place there; both rise.

    The place of one that is not there is that of the next stamp, or of the last one.
    """
    if not len(stamps):
        return np.zeros(len(wanted), bool), np.zeros(len(wanted), np.intp)
    begin = int(np.searchsorted(stamps, wanted[:1])[0]) if len(wanted) else 0
    if np.array_equal(stamps[begin : begin + len(wanted)], wanted):  # as they mostly are: a tenth of the time
        return np.ones(len(wanted), bool), np.arange(begin, begin + len(wanted))
    places = np.minimum(np.searchsorted(stamps, wanted), len(stamps) - 1)
    return stamps[places] == wanted, places


def _union(stamps: Times, others: Times) -> Times:
    """Return all of two rows of stamps; mostly the others are among the first."""
    lacking = others[~places_in(stamps, others)[0]]
    return np.union1d(stamps, lacking) if lacking.size else stamps
