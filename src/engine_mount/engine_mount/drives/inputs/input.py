"""What a recording gives to replay: ramps of mount_init and runs of mount_control, with their samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from engine_mount.drives.inputs.parameter_changes import recorded_changes
from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp, measured_gaps, ramps_of
from engine_mount.drives.inputs.taken import (
    BREAK,
    Column,
    ControlRun,
    Notes,
    RecordedAnswers,
    ReplayError,
    Times,
    control_runs,
    quiet_at_first,
)
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Payloads
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
    session_parameters,
)
from engine_mount.settings.chosen import control_parameters, with_recorded_policy
from engine_mount.signals.importing.provenance import SCENARIO
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged
from mount_ros.messages.force_table import ForceTable
from mount_ros.topics import Topic

_INPUTS = (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.COIL_TEMPERATURE)
_READ = (
    *_INPUTS,
    topics.CURRENT_SETPOINT,
    topics.CONTROL_TRACE,
    topics.AIR_GAP,
    topics.CURRENT_FORCE_TABLE,
    topics.SESSION,
)
_TAKEN_AS_BEFORE = ('policy', 'sample_rate')  # what sessions without them were made with is known


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
    displacement = displacement_of(recording)
    notes = Notes(recording.time_axis.zero)
    session = session_of(recording, notes)
    parameters = parameters_of(session, notes)
    first = int(displacement[0][0])
    gaps = recorded_gaps(recording, None if gap is None else dated(gap, first - SAMPLE_TIME_NS))
    answers = recorded_answers(recording, parameters['mount_control'], notes)
    ramps = ramps_of(recording, parameters, gaps, notes)
    runs = control_runs(displacement, answers, ramps, gaps, control_parameters(parameters), notes)
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


def recorded_gaps(recording: Recording, without: MeasuredGap | None = None) -> list[MeasuredGap]:
    """Return the results of all initialisations, `without` where there is none; raises `ReplayError`."""
    gaps = measured_gaps(recording) or ([] if without is None else [without])
    if not gaps:
        raise ReplayError(
            f'{recording.path} holds no air_gap with its current_force_table, so no current can be told; '
            'engine-mount replay takes one of another recording with --table RECORDING, or --table default'
        )
    return gaps


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
    return RecordedAnswers(
        stamps, setpoints['coil_current'][first], trace_stamps, traces, quiet_at_first(control)
    )


# Samples.


def displacement_of(recording: Recording) -> tuple[Times, Column]:
    """Return stamps (ns), rising, and displacement (m); raises `ReplayError` where there is none."""
    if not has(recording, topics.DISPLACEMENT):
        raise ReplayError(
            f'{recording.path} holds no displacement; it has {", ".join(recording.topics) or "no topic"}. '
            'Name a topic and its field with --map displacement=/topic.field'
        )
    series = recording[topics.DISPLACEMENT.name]
    back = np.flatnonzero(np.diff(series.stamps) < -BREAK)
    if back.size:
        raise ReplayError(
            f'{recording.path}: the time of the measurements goes back, from '
            f'{series.stamps[back[0]] / 1e9:.3f} s to {series.stamps[back[0] + 1] / 1e9:.3f} s; '
            'cut the recording there and replay the pieces'
        )
    stamps, first = np.unique(series.stamps, return_index=True)
    return stamps, series['mount'][first]


# The session.


def session_of(recording: Recording, notes: Notes) -> dict[str, Any]:
    """Return the content of the last session message; {} with a note where there is none."""
    try:
        content = session_content(recorded_session(recording))
    except SessionError as error:
        notes.append(f'{error}: all parameters are the defaults')
        return {}
    if not content:
        notes.append('the recording holds no session: all parameters are the defaults')
    return content


def parameters_of(session: dict[str, Any], notes: Notes) -> dict[str, dict[str, Any]]:
    """Return the recorded parameters of the nodes that replay, those that the nodes still know.

    Where no controller was at work, as in what was imported, they are the defaults.
    """
    known = defaults_of_nodes()
    recorded = session_parameters(session)
    found: dict[str, dict[str, Any]] = {}
    for node in ('mount_control', 'mount_init'):
        values = recorded.get(node, {})
        found[node] = {name: value for name, value in values.items() if name in known[node]}
        new = [name for name in known[node] if name not in found[node] and name not in _TAKEN_AS_BEFORE]
        if new and found[node] and len(new) < len(known[node]) // 2:
            notes.append(f'{node}: {", ".join(new)} is not in the session; the default is taken')
    was_controlled = bool(session) and session.get('scenario') != SCENARIO
    return checked_settings(with_recorded_policy(found) if was_controlled else found)


def recorded_parameters(recording: Recording, notes: Notes) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of the nodes that replay, as recorded and still known."""
    return parameters_of(session_of(recording, notes), notes)


def has(recording: Recording, topic: Topic) -> bool:
    """Return whether the recording holds a message of the topic, in any namespace."""
    return topic.name in recording and recording.topics[recording.resolve(topic.name)].message_count > 0


def _messages(recording: Recording, topic: Topic) -> Messages:
    series = recording[topic.name]
    return Messages(series.topic, series.payloads, series.receive_times)


def _span(stamps: Times, notes: Notes) -> str:
    return f'{notes.at(int(stamps[0]))} .. {notes.at(int(stamps[-1]))}' if len(stamps) else 'no sample'
