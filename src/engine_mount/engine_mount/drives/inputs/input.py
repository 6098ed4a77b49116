"""What a recording gives to replay: ramps of mount_init and runs of mount_control, with their samples."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.drives.inputs.consumed_samples import (
    BREAK,
    Column,
    ControlRun,
    MeasuredGap,
    Notes,
    Ramp,
    RecordedAnswers,
    ReplayError,
    Times,
    control_runs,
    quiet_at_first,
)
from engine_mount.recordings.recording import Recording, open_run
from engine_mount.recordings.series import Series
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
    session_parameters,
)
from engine_mount.recordings.times import each_once
from engine_mount.settings.chosen import (
    Parameters,
    chosen_initialisation,
    chosen_specimen,
    control_parameters,
    with_recorded_policy,
)
from engine_mount.signals.channels import SCENARIO
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_init.parameters import InitParameters
from mount_models.actuator import contact_force, current_force_table, offset_current
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME_NS
from mount_models.specimen import SpecimenError
from mount_ros import topics
from mount_ros.messages.event import ParametersChanged, read_change
from mount_ros.messages.force_table import ForceTable, from_message
from mount_ros.messages.scalars import MessageError
from mount_ros.topics import Topic
from mount_sim.plant.closing import ClosingMechanics

_INPUTS = (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.COIL_TEMPERATURE)
_READ = (
    *_INPUTS,
    topics.CURRENT_SETPOINT,
    topics.CONTROL_TRACE,
    topics.AIR_GAP,
    topics.CURRENT_FORCE_TABLE,
    topics.SESSION,
)
_CONTROL = 'mount_control'
_KNOWN_OF_OLDER = ('policy', 'sample_rate')  # what sessions without them were made with is known


@dataclass
class ReplayInput:
    """Everything that goes into a replay; `notes` are sentences on what is not as one would expect.

    `zero` is the stamp (ns) from which times are told, the zero of the recording's time axis; `log_shift`
    (ns) leads from stamps to log times. `messages` are displacement, coil ripple and coil temperature by
    their relative names.
    """

    source: str
    parts: list[Ramp | ControlRun]
    parameters: dict[str, dict[str, Any]]
    answers: RecordedAnswers | None
    messages: dict[str, Series]
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

    def seconds(self, stamps: Times) -> Column:
        """Return the times (s) of stamps (ns) on the recording's time axis."""
        return (stamps - self.zero) / 1e9


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
    gaps = recorded_gaps(recording, None if gap is None else gap.dated(first - SAMPLE_TIME_NS))
    answers = recorded_answers(recording, parameters[_CONTROL], notes)
    ramps = ramps_of(recording, parameters, gaps, notes)
    runs = control_runs(displacement, answers, ramps, gaps, control_parameters(parameters), notes)
    if not runs:
        span = f'{notes.at(first)} .. {notes.at(int(displacement[0][-1]))}'
        raise ReplayError(
            f'{recording.path}: no overlap of displacement ({span}) and the time after the air_gap '
            f'({notes.at(gaps[0].stamp)}): the controller had nothing to do'
        )
    if gap is not None:
        ramps, runs = [], [replace(run, gap=gap.dated(run.gap.stamp)) for run in runs]
    series = {topic.name: recording[topic.name] for topic in _INPUTS if has(recording, topic)}
    shaking = series[topics.DISPLACEMENT.name]
    return ReplayInput(
        source=recording.short_name,
        parts=sorted([*ramps, *runs], key=lambda part: int(part.stamps[0])),
        parameters=parameters,
        answers=answers,
        messages=series,
        zero=notes.zero,
        log_shift=int(shaking.receive_times[0] - shaking.stamps[0]),
        session=session,
        notes=notes,
        changes=recorded_changes(recording),
    )


def measured_gaps(recording: Recording) -> list[MeasuredGap]:
    """Return the results of all initialisations in the recording that have both their messages, by stamp."""
    if topics.AIR_GAP.name not in recording or topics.CURRENT_FORCE_TABLE.name not in recording:
        return []
    tables = {}
    for message in recording[topics.CURRENT_FORCE_TABLE.name].messages():
        try:
            table = from_message(message)
        except MessageError:
            continue  # a node does not take it either
        tables[table.stamp] = table
    series = recording[topics.AIR_GAP.name]
    columns = {name: series[name] for name in topics.AIR_GAP.names}
    gaps = {}
    for place, stamp in enumerate(series.stamps.tolist()):
        if stamp in tables:
            numbers = {name: float(column[place]) for name, column in columns.items()}
            gaps[stamp] = MeasuredGap(stamp, numbers, tables[stamp])
    return [gaps[stamp] for stamp in sorted(gaps)]


def recorded_gaps(recording: Recording, without: MeasuredGap | None = None) -> list[MeasuredGap]:
    """Return the results of all initialisations, `without` where there is none; raises `ReplayError`."""
    gaps = measured_gaps(recording) or ([] if without is None else [without])
    if not gaps:
        raise ReplayError(
            f'{recording.path} holds no air_gap with its current_force_table, so no current is known; '
            'engine-mount replay takes one of another recording with --table RECORDING, or --table default'
        )
    return gaps


def ramps_of(
    recording: Recording, parameters: Parameters, gaps: Sequence[MeasuredGap], notes: list[str]
) -> list[Ramp]:
    """Return the ramps that are in the recording from their first sample to their last."""
    if not (has(recording, topics.COIL_RIPPLE) and has(recording, topics.CURRENT_SETPOINT) and gaps):
        return []
    try:
        length = chosen_initialisation(parameters).length
    except SpecimenError as error:
        notes.append(f'initialisations are not replayed, their results are taken as recorded: {error}')
        return []
    ripple = recording[topics.COIL_RIPPLE.name]
    stamps, first = np.unique(ripple.stamps, return_index=True)
    answered = np.intersect1d(stamps, recording[topics.CURRENT_SETPOINT.name].stamps)
    columns = ripple['coil_current'], *map(ripple.derivative, ('coil_current', 'flux_density'))
    temperatures: list[tuple[int, float]] = []
    if has(recording, topics.COIL_TEMPERATURE):
        series = recording[topics.COIL_TEMPERATURE.name]
        temperatures = list(zip(series.stamps.tolist(), series['temperature'].tolist(), strict=True))
    ramps = []
    for gap in gaps:
        taken = answered[answered <= gap.stamp][-length:]
        if len(taken) < length or taken[-1] != gap.stamp:
            notes.append(
                f'the ramp before the air_gap of stamp {gap.stamp / 1e9:.3f} s is not wholly in the '
                'recording; its result is taken as recorded'
            )
            continue
        places = first[np.searchsorted(stamps, taken)]
        warm = tuple(each for each in temperatures if each[0] <= gap.stamp)
        ramps.append(Ramp(taken, *(column[places] for column in columns), warm))
    return ramps


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
    stamps, first = each_once(setpoints.stamps)
    currents = setpoints['coil_current'][first]
    if not has(recording, topics.CONTROL_TRACE):
        notes.append('the recording holds no control_trace: every sample with a setpoint counts as taken')
        empty = dict.fromkeys(topics.CONTROL_TRACE.names, np.empty(0))
        return RecordedAnswers(stamps, currents, np.empty(0, np.int64), empty)
    series = recording[topics.CONTROL_TRACE.name]
    trace_stamps, places = each_once(series.stamps)
    traces = {name: series[name][places] for name in series.names}
    return RecordedAnswers(stamps, currents, trace_stamps, traces, quiet_at_first(control))


# Samples.


def displacement_of(recording: Recording) -> tuple[Times, Column]:
    """Return stamps (ns), rising, and displacement (m); raises `ReplayError` where there is none."""
    if not has(recording, topics.DISPLACEMENT):
        raise ReplayError(
            f'{recording.path} holds no displacement; it has {", ".join(recording.topics) or "no topic"}. '
            'engine-mount import makes a recording with one of a foreign file'
        )
    series = recording[topics.DISPLACEMENT.name]
    back = np.flatnonzero(np.diff(series.stamps) < -BREAK)
    if back.size:
        raise ReplayError(
            f'{recording.path}: the time of the measurements goes back, from '
            f'{series.stamps[back[0]] / 1e9:.3f} s to {series.stamps[back[0] + 1] / 1e9:.3f} s; '
            'cut the recording there and replay the pieces'
        )
    stamps, first = each_once(series.stamps)
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
        new = [name for name in known[node] if name not in found[node] and name not in _KNOWN_OF_OLDER]
        if new and found[node] and len(new) < len(known[node]) // 2:
            notes.append(f'{node}: {", ".join(new)} is not in the session; the default is taken')
    was_controlled = bool(session) and session.get('scenario') != SCENARIO
    return checked_settings(with_recorded_policy(found) if was_controlled else found)


def has(recording: Recording, topic: Topic) -> bool:
    """Return whether the recording holds a message of the topic, in any namespace."""
    return topic.name in recording and recording.topics[recording.resolve(topic.name)].message_count > 0


# Changes of parameters while the recording ran: mount_control reports them on `event`.


def recorded_changes(recording: Recording) -> list[ParametersChanged]:
    """Return the changes of parameters of mount_control in the order of their stamps."""
    if topics.EVENT.name not in recording:
        return []
    found = (read_change(message.data) for message in recording[topics.EVENT.name].messages())
    changes = [change for change in found if change is not None and change.node == _CONTROL]
    return sorted(changes, key=lambda change: change.time)


def without(changes: Sequence[ParametersChanged], names: Collection[str]) -> list[ParametersChanged]:
    """Return the changes of all parameters but `names`, which are to be other than recorded."""
    kept = [
        change._replace(values={name: value for name, value in change.values.items() if name not in names})
        for change in changes
    ]
    return [change for change in kept if change.values]


def with_recorded_changes(parameters: Parameters, changes: Sequence[ParametersChanged]) -> Parameters:
    """Return the parameters of all nodes after these changes."""
    own = dict(parameters.get(_CONTROL, {}))
    for change in changes:
        own |= change.values
    return {**parameters, _CONTROL: own}


DEFAULT_TABLE = 'default'


def default_gap(parameters: Parameters) -> MeasuredGap:
    """Return the nominal gaps and the force table of the specimen in use, as if just measured."""
    specimen, nominal = chosen_specimen(parameters), ClosingMechanics()
    light_pressure = with_flattened(InitParameters(), parameters.get('mount_init', {})).light_pressure
    rest, contact = nominal.rest_gap, nominal.contact_gap
    law, spring = specimen.force_law, specimen.spring_stiffness
    table = current_force_table(law, spring, specimen.pad_stiffness, rest, contact, specimen.current_limit)
    numbers = {
        'rest_gap': rest,
        'contact_gap': contact,
        'rest_gap_std': 0.0,
        'contact_gap_std': 0.0,
        'contact_force': contact_force(spring, rest, contact),
        'offset_current': offset_current(law, spring, rest, contact, light_pressure),
    }
    return MeasuredGap(0, numbers, ForceTable(0, table[0], table[1]))


def chosen_gap(table: str) -> tuple[MeasuredGap, str]:
    """Return the last measured gap of the recording `table`, or the default one, and a sentence on which."""
    if table == DEFAULT_TABLE:
        gap, name = default_gap({}), chosen_specimen({}).name
        rest, contact = (1e6 * gap.numbers[which] for which in ('rest_gap', 'contact_gap'))
        return gap, (
            f'current-force table: calculated for the specimen {name!r} with the nominal gaps {rest:.0f} um '
            f'at rest and {contact:.0f} um in contact; nothing was measured on this mount'
        )
    gaps = measured_gaps(open_run(Path(table)))
    if not gaps:
        raise ReplayError(f'--table {table}: that recording holds no air_gap with its current_force_table')
    return gaps[-1], f'current-force table: measured in {Path(table).name} at {gaps[-1].stamp / 1e9:.3f} s'
