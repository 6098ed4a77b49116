"""What a recording gives to replay: ramps of mount_init and runs of mount_control, with their samples.

Only the samples that a node has taken belong to its run: in real time a message can be recorded and yet
come too late for the controller, which then bridged it. Whether it did stands in `control_trace`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.bag.recording import Recording
from mount_bags.messages.series import Payloads
from mount_bags.run.session import SessionError, recorded_session, session_content, session_parameters
from mount_bringup.chosen import control_parameters, with_recorded_policy
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.parameters import ControlParameters
from mount_control.settings import policy_parameters
from mount_models.sampling import SAMPLE_TIME_NS, sample_time_ns
from mount_replay.given.parameter_changes import recorded_changes
from mount_replay.given.ramps import MeasuredGap, Ramp, measured_gaps, ramps_of
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged
from mount_ros.messages.force_table import ForceTable
from mount_ros.topics import Topic

Times = NDArray[np.int64]
Column = NDArray[np.float64]

SECOND = 1_000_000_000  # ns
_INPUTS = (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.COIL_TEMPERATURE)
_READ = (
    *_INPUTS,
    topics.CURRENT_SETPOINT,
    topics.CONTROL_TRACE,
    topics.AIR_GAP,
    topics.CURRENT_FORCE_TABLE,
    topics.SESSION,
)
_QUIET_AT_FIRST = ('velocity', 'friction_deflection', 'bridged_samples')  # 0 in the first step of all
_LENGTHS = ('m', 'm/s')  # units of a policy's own fields that are 0 in its first step
_TAKEN_AS_BEFORE = ('policy', 'sample_rate')  # what sessions without them were made with is known
_BREAK = SECOND  # ns: after it the controller takes no table from before


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
    quiet_at_first: tuple[str, ...] = _QUIET_AT_FIRST


@dataclass(frozen=True)
class Messages:
    """The recorded messages of one topic by which a replay can be told again, with their log times in ns."""

    name: str  # with its namespace
    payloads: Sequence[bytes] | Payloads
    log_times: Times


@dataclass
class ReplayInput:
    """Everything that goes into a replay; `notes` says in sentences what is not as one would expect.

    `zero` is the stamp (ns) from which times are told, the zero of the recording's time axis; `log_shift`
    (ns) leads from stamps to log times. `messages` are those of displacement, coil ripple and coil
    temperature by their relative names.
    """

    source: str
    parts: list[Ramp | ControlRun]
    parameters: dict[str, dict[str, Any]]
    answers: RecordedAnswers | None
    messages: dict[str, Messages]
    zero: int = 0
    log_shift: int = 0
    session: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=Notes)
    changes: list[ParametersChanged] = field(default_factory=list)  # of mount_control, while it ran

    @property
    def controls(self) -> list[ControlRun]:
        """The runs of the controller."""
        return [part for part in self.parts if isinstance(part, ControlRun)]

    @property
    def sample_time(self) -> float:
        """Time between two samples in s."""
        return 1.0 / control_parameters(self.parameters).sample_rate

    @property
    def duration(self) -> float:
        """Length of what is replayed in s: the samples of ramps and runs."""
        return sum(len(part.stamps) for part in self.parts) * self.sample_time


def replay_input(recording: Recording, gap: MeasuredGap | None = None) -> ReplayInput:
    """Read what `recording`, one of this project, gives to replay; raises `ReplayError`.

    With `gap` the controller is activated with that one instead of the recorded ones.
    """
    recording.load(topic.name for topic in _READ if topic.name in recording)
    displacement = _displacement(recording)
    notes = Notes(recording.time_axis.zero)
    session = _session_of(recording, notes)
    parameters = _parameters_of(session, notes)
    gaps = measured_gaps(recording)
    if gap is not None and not gaps:
        gaps = [dated(gap, int(displacement[0][0]) - SAMPLE_TIME_NS)]
    if not gaps:
        raise ReplayError(
            f'{recording.path} holds no air_gap with its current_force_table, so no current can be told; '
            'give one of another recording with --table RECORDING, or --table default'
        )
    answers = recorded_answers(recording, parameters['mount_control'], notes)
    ramps = ramps_of(recording, parameters, gaps, notes)
    control = control_parameters(parameters)
    period = sample_time_ns(control.sample_rate)
    samples = _samples_taken(displacement, answers, ramps, gaps, period, notes)
    runs = _split_into_runs(*samples, displacement[0], answers, gaps, control, notes)
    if not runs:
        raise ReplayError(
            f'{recording.path}: no overlap of displacement ({_span(displacement[0], notes)}) and the time '
            f'after the air_gap ({notes.at(gaps[0].stamp)}): the controller had nothing to do'
        )
    if gap is not None:
        ramps, runs = [], [replace(run, gap=dated(gap, run.gap.stamp)) for run in runs]
    parts = sorted([*ramps, *runs], key=lambda part: int(part.stamps[0]))
    messages = {topic.name: _messages(recording, topic) for topic in _INPUTS if has(recording, topic)}
    series = recording[topics.DISPLACEMENT.name]
    log_shift = int(series.receive_times[0] - series.stamps[0])
    name = recording.short_name
    changes = recorded_changes(recording)
    return ReplayInput(
        name, parts, parameters, answers, messages, notes.zero, log_shift, session, notes, changes
    )


def dated(gap: MeasuredGap, stamp: int) -> MeasuredGap:
    """Return the same result of an initialisation as of another time (ns)."""
    return MeasuredGap(stamp, gap.numbers, ForceTable(stamp, gap.table.current, gap.table.normal_force))


def recorded_answers(
    recording: Recording, control: Mapping[str, Any], notes: Notes
) -> RecordedAnswers | None:
    """Return the recorded setpoints, the first for each stamp, and traces; None where there are none.

    `control` holds the recorded parameters of mount_control.
    """
    if not has(recording, topics.CURRENT_SETPOINT):
        notes.append('the recording holds no current_setpoint: there is nothing to compare with')
        return None
    setpoints = recording[topics.CURRENT_SETPOINT.name]
    # When mount_control is deactivated it answers its last sample once more, with 0 A.
    stamps, first = np.unique(setpoints.stamps, return_index=True)
    if not has(recording, topics.CONTROL_TRACE):
        notes.append('the recording holds no control_trace: every sample with a setpoint counts as taken')
        empty = np.empty(0)
        traces = dict.fromkeys(topics.CONTROL_TRACE.names, empty)
        return RecordedAnswers(stamps, setpoints['coil_current'][first], empty.astype(np.int64), traces)
    series = recording[topics.CONTROL_TRACE.name]
    trace_stamps, places = np.unique(series.stamps, return_index=True)
    traces = {name: series[name][places] for name in series.names}
    own = policy_parameters(control)[0].TRACE
    quiet = (*_QUIET_AT_FIRST, *(name for name, unit in own.items() if unit in _LENGTHS))
    return RecordedAnswers(stamps, setpoints['coil_current'][first], trace_stamps, traces, quiet)


# Samples.


def _displacement(recording: Recording) -> tuple[Times, Column]:
    if not has(recording, topics.DISPLACEMENT):
        raise ReplayError(
            f'{recording.path} holds no displacement; it has {", ".join(recording.topics) or "no topic"}. '
            'Name a topic and its field with --map displacement=/topic.field'
        )
    series = recording[topics.DISPLACEMENT.name]
    back = np.flatnonzero(np.diff(series.stamps) < -_BREAK)
    if back.size:
        raise ReplayError(
            f'{recording.path}: the time of the measurements goes back, from '
            f'{series.stamps[back[0]] / 1e9:.3f} s to {series.stamps[back[0] + 1] / 1e9:.3f} s; '
            'cut the recording there and replay the pieces'
        )
    stamps, first = np.unique(series.stamps, return_index=True)
    return stamps, series['mount'][first]


def _samples_taken(
    displacement: tuple[Times, Column],
    answers: RecordedAnswers | None,
    ramps: list[Ramp],
    gaps: list[MeasuredGap],
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
    taken = np.union1d(answered, _taken_without_answer(stamps, answered, answers, period, notes))
    _note_lost(stamps, taken, notes)
    return _with_values(taken, displacement, answers, notes)


def _answered_by_control(answers: RecordedAnswers, ramps: list[Ramp], gaps: list[MeasuredGap]) -> Times:
    """Return the stamps of the samples with a setpoint or a trace of mount_control."""
    by_init = np.concatenate([ramp.stamps for ramp in ramps]) if ramps else np.empty(0, np.int64)
    setpoints = np.setdiff1d(answers.stamps, by_init, assume_unique=True)
    beginning = gaps[0].stamp
    if answers.trace_stamps.size:
        beginning = min(beginning, int(answers.trace_stamps[0]) - 1)
    answered = np.union1d(setpoints, answers.trace_stamps)
    return answered[answered > beginning]


def _without_foreign(answered: Times, answers: RecordedAnswers, period: int, notes: Notes) -> Times:
    """Leave out setpoints that no step of the controller explains: those of a ramp that was given up.

    Without a trace the controller only answers 0 A, and a few answers whose trace was not recorded.
    """
    if not answers.trace_stamps.size:
        return answered
    traced = np.isin(answered, answers.trace_stamps, assume_unique=True)
    currents = answers.currents[
        np.clip(np.searchsorted(answers.stamps, answered), 0, len(answers.stamps) - 1)
    ]
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
    return np.setdiff1d(answered, foreign, assume_unique=True)


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
    return quiet & ~np.roll(quiet, 1)


def _note_lost(stamps: Times, taken: Times, notes: Notes) -> None:
    inside = stamps[(stamps >= taken[0]) & (stamps <= taken[-1])]
    late = np.setdiff1d(inside, taken, assume_unique=True)
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
    found, column = _looked_up(taken, stamps, values)
    lacking = taken[~found]
    if lacking.size and 'displacement' in answers.traces:
        of_trace = _looked_up(lacking, answers.trace_stamps, answers.traces['displacement'])
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


def _looked_up(wanted: Times, stamps: Times, values: Column) -> tuple[NDArray[np.bool_], Column]:
    """Return whether each wanted stamp is there, and its value, NaN where it is not."""
    if not len(stamps):
        return np.zeros(len(wanted), bool), np.full(len(wanted), np.nan)
    places = np.clip(np.searchsorted(stamps, wanted), 0, len(stamps) - 1)
    found = stamps[places] == wanted
    return found, np.where(found, values[places], np.nan)


# Runs.


def _split_into_runs(
    stamps: Times,
    values: Column,
    all_stamps: Times,
    answers: RecordedAnswers | None,
    gaps: list[MeasuredGap],
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
    gaps: list[MeasuredGap],
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
    return after - before > _BREAK and heard.size > 1 and bool(np.diff(heard).max() <= _BREAK)


def _first_step_is_afresh(first: int, answers: RecordedAnswers | None) -> bool:
    if answers is None or not answers.trace_stamps.size:
        return True
    step = int(np.searchsorted(answers.trace_stamps, first))
    return step >= len(answers.trace_stamps) or _starts_afresh(answers, step)


# The session.


def _session_of(recording: Recording, notes: Notes) -> dict[str, Any]:
    """Return the content of the last session message; {} with a note where there is none."""
    try:
        content = session_content(recorded_session(recording))
    except SessionError as error:
        notes.append(f'{error}: all parameters are the defaults')
        return {}
    if not content:
        notes.append('the recording holds no session: all parameters are the defaults')
    return content


def _parameters_of(session: dict[str, Any], notes: Notes) -> dict[str, dict[str, Any]]:
    """Return the recorded parameters of the nodes that replay, those that the nodes still know."""
    known = defaults_of_nodes()
    recorded = session_parameters(session)
    found: dict[str, dict[str, Any]] = {}
    for node in ('mount_control', 'mount_init'):
        values = recorded.get(node, {})
        found[node] = {name: value for name, value in values.items() if name in known[node]}
        new = [name for name in known[node] if name not in found[node] and name not in _TAKEN_AS_BEFORE]
        if new and found[node] and len(new) < len(known[node]) // 2:
            notes.append(f'{node}: {", ".join(new)} is not in the session; the default is taken')
    return checked_settings(with_recorded_policy(found) if session else found)


def recorded_parameters(recording: Recording, notes: Notes) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of the nodes that replay, as recorded and still known."""
    return _parameters_of(_session_of(recording, notes), notes)


def has(recording: Recording, topic: Topic) -> bool:
    """Return whether the recording holds a message of the topic, in any namespace."""
    return topic.name in recording and recording.topics[recording.resolve(topic.name)].message_count > 0


def _messages(recording: Recording, topic: Topic) -> Messages:
    series = recording[topic.name]
    return Messages(series.topic, series.payloads, series.receive_times)


def _span(stamps: Times, notes: Notes) -> str:
    return f'{notes.at(int(stamps[0]))} .. {notes.at(int(stamps[-1]))}' if len(stamps) else 'no sample'
