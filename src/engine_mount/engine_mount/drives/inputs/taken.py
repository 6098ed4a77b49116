"""Which samples the controller has taken, and in which runs, from one activation to the next.

Only the samples that a node has taken belong to its run: in real time a message can be recorded and yet
come too late for the controller, which then bridged it. Whether it did stands in `control_trace`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp
from mount_control.settings import ControlParameters, policy_parameters
from mount_models.sampling import sample_time_ns

Times = NDArray[np.int64]
Column = NDArray[np.float64]

SECOND = 1_000_000_000  # ns
BREAK = SECOND
"""ns: after it the controller takes no table from before."""
QUIET_AT_FIRST = ('velocity', 'friction_deflection', 'bridged_samples')
"""What is 0 in the first step of an empty memory, of every policy."""
_LENGTHS = ('m', 'm/s')  # units of a policy's own fields that are 0 in its first step


class ReplayError(ValueError):
    """A recording cannot be replayed as asked; the text says why and what would help."""


class Notes(list[str]):
    """Sentences on what is not as one would expect; `zero` is the stamp (ns) from which times are told."""

    def __init__(self, zero: int = 0):
        super().__init__()
        self.zero = zero

    def at(self, stamp: int) -> str:
        """Return the time of a stamp (ns), in words."""
        return f'{(stamp - self.zero) / SECOND:.3f} s'


@dataclass(frozen=True)
class ControlRun:
    """The displacement samples that mount_control took from one activation to its end, stamps rising.

    `gap` is what it was activated with; `from_its_beginning` tells whether the first sample is the first
    that it ever took, so that its memory was empty.
    """

    stamps: Times  # ns
    displacement: Column  # m
    gap: MeasuredGap
    from_its_beginning: bool = True


@dataclass(frozen=True)
class RecordedAnswers:
    """What the recording holds of the controller's answers, by stamp (ns), rising; currents in A."""

    stamps: Times
    currents: Column
    trace_stamps: Times
    traces: dict[str, Column]
    quiet_at_first: tuple[str, ...] = QUIET_AT_FIRST


def quiet_at_first(control: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what is 0 in the first step of an empty memory; `control`: parameters of mount_control."""
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
    samples = _samples_taken(displacement, answers, ramps, gaps, period, notes)
    return _split_into_runs(*samples, displacement[0], answers, gaps, control, notes)


def _samples_taken(
    displacement: tuple[Times, Column],
    answers: RecordedAnswers | None,
    ramps: Sequence[Ramp],
    gaps: Sequence[MeasuredGap],
    period: int,
    notes: Notes,
) -> tuple[Times, Column]:
    """Return the samples (stamps ns, displacement m) that the controller has taken, in all its runs.

    `period` is the time between two of them, ns.
    """
    stamps, values = displacement
    after = stamps > gaps[0].stamp
    if answers is None or not _answered_by_control(answers, ramps, gaps).size:
        if answers is not None:
            notes.append('the controller was not active in this recording: it starts after the air_gap here')
        return stamps[after], values[after]
    answered = _answered_by_control(answers, ramps, gaps)
    answered = _without_foreign(answered, answers, period, notes)
    taken = _union(answered, _taken_without_answer(stamps, answered, answers, period, notes))
    _note_lost(stamps, taken, notes)
    return _with_values(taken, displacement, answers, notes)


def _answered_by_control(
    answers: RecordedAnswers, ramps: Sequence[Ramp], gaps: Sequence[MeasuredGap]
) -> Times:
    """Return the stamps of the samples with a setpoint or a trace of mount_control."""
    by_init = np.concatenate([ramp.stamps for ramp in ramps]) if ramps else np.empty(0, np.int64)
    setpoints = _without(answers.stamps, np.sort(by_init))
    beginning = gaps[0].stamp
    if answers.trace_stamps.size:
        beginning = min(beginning, int(answers.trace_stamps[0]) - 1)
    answered = _union(setpoints, answers.trace_stamps)
    return answered[answered > beginning]


def _without_foreign(answered: Times, answers: RecordedAnswers, period: int, notes: Notes) -> Times:
    """Leave out setpoints that no step of the controller explains: those of a ramp that was given up.

    Without a trace the controller only answers 0 A, and a few answers whose trace was not recorded.
    """
    if not answers.trace_stamps.size:
        return answered
    traced = _among(answered, answers.trace_stamps)
    currents = answers.currents[places_in(answers.stamps, answered)[1]]
    odd = ~traced & (currents != 0.0)  # every answer without a trace has a setpoint
    places = np.searchsorted(answers.trace_stamps, answered[odd])
    bounds = np.concatenate([[-(1 << 62)], answers.trace_stamps, [1 << 62]])
    # nearer is a hole in the traces, not another speaker
    near = bounds[places + 1] - bounds[places] <= 20 * period
    foreign = answered[odd][~near]
    if foreign.size:
        span = f'{notes.at(int(foreign[0]))} to {notes.at(int(foreign[-1]))}'
        notes.append(
            f'{foreign.size} setpoints from {span} are of no step of the controller and of no complete '
            'initialisation (a ramp that was given up?): not replayed'
        )
    return _without(answered, foreign)


def _taken_without_answer(
    stamps: Times, answered: Times, answers: RecordedAnswers, period: int, notes: Notes
) -> Times:
    """Return the samples whose answers were not recorded although the next step did not bridge them."""
    found: list[Times] = []
    bridged = answers.traces.get('bridged_samples', np.empty(0))
    for place in np.flatnonzero(np.diff(answered) > 1.5 * period):
        before, after = int(answered[place]), int(answered[place + 1])
        step = int(np.searchsorted(answers.trace_stamps, after))
        traced = step < len(answers.trace_stamps) and answers.trace_stamps[step] == after
        if not traced or _starts_afresh(answers, step):
            continue
        last_taken = after - (bridged[step] + 0.5) * period
        found.append(stamps[(stamps > before) & (stamps < last_taken)])
    silent = np.concatenate(found) if found else np.empty(0, np.int64)
    if silent.size:
        notes.append(f'the answers to {silent.size} samples are missing in the recording; they are replayed')
    return silent


def _starts_afresh(answers: RecordedAnswers, step: int) -> bool:
    """Whether a recorded step is the first of an empty memory: then nothing moves in it yet."""
    return all(answers.traces[name][step] == 0.0 for name in answers.quiet_at_first if name in answers.traces)


def _moved_then_afresh(answers: RecordedAnswers) -> NDArray[np.bool_]:
    """Return which recorded steps are the first of an empty memory right after one that was not empty."""
    quiet = np.ones(len(answers.trace_stamps), bool)
    for name in answers.quiet_at_first:
        quiet &= answers.traces[name] == 0.0 if name in answers.traces else True
    return quiet & ~np.concatenate([[False], quiet[:-1]])


def _note_lost(stamps: Times, taken: Times, notes: Notes) -> None:
    inside = stamps[(stamps >= taken[0]) & (stamps <= taken[-1])]
    late = _without(inside, taken)
    if late.size:
        notes.append(
            f'{late.size} recorded samples did not reach the controller in time, the first at '
            f'{notes.at(int(late[0]))}: left out, as in the drive'
        )


def _with_values(
    taken: Times, displacement: tuple[Times, Column], answers: RecordedAnswers, notes: Notes
) -> tuple[Times, Column]:
    """Return the samples with their displacement: as recorded, else as the trace of the step tells it."""
    stamps, values = displacement
    found, column = looked_up(taken, stamps, values)
    lacking = taken[~found]
    if lacking.size and 'displacement' in answers.traces:
        of_trace = looked_up(lacking, answers.trace_stamps, answers.traces['displacement'])
        column[~found] = of_trace[1]
        notes.append(
            f'{np.count_nonzero(of_trace[0])} samples that the recorder lost are taken from control_trace'
        )
        found[~found] = of_trace[0]
    if not found.all():
        notes.append(
            f'{np.count_nonzero(~found)} answers, the first at {notes.at(int(taken[~found][0]))}, have no '
            'recorded displacement; they cannot be replayed'
        )
    return taken[found], column[found]


def _union(stamps: Times, others: Times) -> Times:
    """Return all of two rows of rising stamps, rising; mostly the others are among the first."""
    lacking = others[~_among(others, stamps)]
    return np.union1d(stamps, lacking) if lacking.size else stamps


def _without(stamps: Times, others: Times) -> Times:
    """Return those of rising stamps that are not among others, which rise too."""
    return stamps[~_among(stamps, others)]


def _among(stamps: Times, others: Times) -> NDArray[np.bool_]:
    return places_in(others, stamps)[0]


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
    if not (len(stamps) and len(wanted)):
        return np.zeros(len(wanted), np.bool_), np.zeros(len(wanted), np.intp)
    # Mostly one of the two is a part of the other, or both are parts of the same without a hole.
    before, behind = int(np.searchsorted(wanted, stamps[0])), int(np.searchsorted(stamps, wanted[0]))
    common = min(len(wanted) - before, len(stamps) - behind)
    if np.array_equal(wanted[before : before + common], stamps[behind : behind + common]):
        found = np.zeros(len(wanted), np.bool_)
        found[before : before + common] = True
        return found, np.clip(np.arange(behind - before, behind - before + len(wanted)), 0, len(stamps) - 1)
    places = np.clip(np.searchsorted(stamps, wanted), 0, len(stamps) - 1)
    return stamps[places] == wanted, places


# Runs.


def _split_into_runs(
    stamps: Times,
    values: Column,
    all_stamps: Times,
    answers: RecordedAnswers | None,
    gaps: Sequence[MeasuredGap],
    control: ControlParameters,
    notes: Notes,
) -> list[ControlRun]:
    if not len(stamps):
        return []
    period = sample_time_ns(control.sample_rate)
    steps = set((np.flatnonzero(np.diff(stamps) > 1.5 * period) + 1).tolist())
    if answers is not None:  # in lock-step an activation takes no time
        steps |= set(np.searchsorted(stamps, answers.trace_stamps[_moved_then_afresh(answers)]).tolist())
    begins = [0]
    for place in sorted(steps - {0, len(stamps)}):
        before, after = int(stamps[place - 1]), int(stamps[place])
        if _was_activated_between(before, after, all_stamps, answers, gaps, control.longest_bridge):
            begins.append(place)
    runs = []
    for begin, end in zip(begins, [*begins[1:], len(stamps)], strict=True):
        gap = [gap for gap in gaps if gap.stamp < stamps[begin]]
        whole = begin > 0 or _first_step_is_afresh(int(stamps[begin]), answers)
        if not whole:
            notes.append(
                f'the recording begins while the controller is at work, at {notes.at(int(stamps[begin]))}: '
                'what it remembered is not in it, so the replay starts afresh there'
            )
        runs.append(ControlRun(stamps[begin:end], values[begin:end], (gap or gaps[:1])[-1], whole))
    return runs


def _was_activated_between(
    before: int,
    after: int,
    all_stamps: Times,
    answers: RecordedAnswers | None,
    gaps: Sequence[MeasuredGap],
    longest_bridge: float,
) -> bool:
    """Whether mount_control was activated anew between two samples that it took one after the other."""
    if answers is not None and answers.trace_stamps.size:
        step = int(np.searchsorted(answers.trace_stamps, after))
        traced = step < len(answers.trace_stamps) and int(answers.trace_stamps[step]) == after
        if traced and not _starts_afresh(answers, step):
            return False
        if traced and after - before <= longest_bridge * SECOND:
            return True
    if any(before <= gap.stamp < after for gap in gaps):
        return True
    # Without samples for so long a controller discards its table; with samples and no answers it is off.
    heard = all_stamps[(all_stamps >= before) & (all_stamps <= after)]
    return after - before > BREAK and heard.size > 1 and bool(np.diff(heard).max() <= BREAK)


def _first_step_is_afresh(first: int, answers: RecordedAnswers | None) -> bool:
    if answers is None or not answers.trace_stamps.size:
        return True
    step = int(np.searchsorted(answers.trace_stamps, first))
    return step >= len(answers.trace_stamps) or _starts_afresh(answers, step)
