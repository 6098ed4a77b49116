"""One recording as recorded and with a change, both through the core controller."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from engine_mount.drives.agreement import SETTLED, SETTLING
from engine_mount.drives.core import ControlReplay, run_ramp
from engine_mount.drives.inputs.consumed_samples import (
    Column,
    Notes,
    RecordedAnswers,
    ReplayError,
    Times,
    control_runs,
    looked_up,
    quiet_at_first,
)
from engine_mount.drives.inputs.gap import default_gap
from engine_mount.drives.inputs.input import (
    displacement_of,
    has,
    parameters_of,
    ramps_of,
    recorded_changes,
    recorded_gaps,
    session_of,
    without,
)
from engine_mount.drives.replay import check_parameters, refuse_other_rate, with_changes
from engine_mount.fleet.figures import AnswerFigures, compared_answers, difference
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.times import each_once
from engine_mount.reports.fleet.looks import Signals
from engine_mount.settings.chosen import check_effect, control_parameters
from engine_mount.signals.importing.provenance import SCENARIO
from mount_ros.topics import (
    AIR_GAP,
    CONTROL_TRACE,
    CURRENT_FORCE_TABLE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    EVENT,
    SESSION,
    Topic,
)

Parameters = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}."""

_AT_ONCE = 4096  # samples, chosen: their traces, 0.8 MB, stay in the processor's cache until they are summed
_SELDOM = (AIR_GAP, CURRENT_FORCE_TABLE, SESSION, EVENT)


class Recorded(NamedTuple):
    """What a recording says of its controller, beside its samples."""

    recording: Recording
    session: dict[str, Any]
    parameters: dict[str, dict[str, Any]]


class Compared(NamedTuple):
    """A recording as recorded and with a change: the figures, as columns of a row, and the signals."""

    row: dict[str, Any]
    signals: Signals


def recorded_in(recording: Recording) -> Recorded:
    """Read what a recording says beside its samples, not the whole of it; raises a `ValueError`."""
    recording.load(topic.name for topic in _SELDOM if topic.name in recording)
    session = session_of(recording, Notes())
    return Recorded(recording, session, parameters_of(session, Notes()))


def check_concerned(recorded: Recorded, changes: Parameters) -> None:
    """Raise `NoEffectError` where the policy lacks what is changed, or a `ValueError` for another rate."""
    refuse_other_rate(recorded.parameters, changes)
    check_effect(changes.get('mount_control', {}), control_parameters(recorded.parameters).policy)


def changed_parameters(recorded: Recorded, changes: Parameters) -> dict[str, dict[str, Any]]:
    """Return the parameters with the changes; raises a `ValueError` where a node would refuse them."""
    check_concerned(recorded, changes)
    parameters = with_changes(recorded.parameters, changes)
    check_parameters(parameters)
    return parameters


def compare_setpoints(recorded: Recorded, changes: Parameters) -> Compared:
    """Return what the controller answers to the recorded displacement, as recorded and with `changes`.

    Raises a `ValueError` with the reason where there is nothing to answer.
    """
    recording, parameters = recorded.recording, recorded.parameters
    changed = changed_parameters(recorded, changes)
    is_imported = recorded.session.get('scenario') == SCENARIO  # such a recording holds no gap
    gaps = recorded_gaps(recording, default_gap({}).dated(0) if is_imported else None)
    ramps = []
    if 'mount_init' in changes or len(gaps) > 1:  # replayed, or between two runs of the controller
        ramps = ramps_of(recording, parameters, gaps, Notes())
    changed_gaps = {}
    if 'mount_init' in changes:
        if not ramps:
            raise ReplayError(
                'there is no initialisation to replay, so parameters of mount_init change nothing'
            )
        changed_gaps = {gap.stamp: gap for gap in (run_ramp(ramp, changed).gap for ramp in ramps)}
    answers = _recorded_answers(recording, parameters)
    control = control_parameters(parameters)
    runs = control_runs(displacement_of(recording), answers, ramps, gaps, control, Notes())
    if not runs:
        raise ReplayError(
            f'{recording.path}: no overlap of displacement and the time after the air_gap: the controller '
            'had nothing to do'
        )
    told = recorded_changes(recording)
    of_changed = without(told, changes.get('mount_control', {}))
    figures = AnswerFigures(), AnswerFigures()
    for run in runs:
        gap = changed_gaps.get(run.gap.stamp, run.gap)
        replays = (
            ControlReplay(int(run.stamps[0]), run.gap, parameters, told),
            ControlReplay(int(run.stamps[0]), gap, changed, of_changed),
        )
        for each, table in zip(figures, (run.gap.table, gap.table), strict=True):
            each.begin_run(table.current, table.normal_force)
        for begin in range(0, len(run.stamps), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            for each, replay in zip(figures, replays, strict=True):
                each.add(replay.answer(run.stamps[part], run.displacement[part]))
    stamps = np.concatenate([run.stamps for run in runs])
    displacement = np.concatenate([run.displacement for run in runs])
    zero = recording.time_axis.zero
    time = (stamps - zero) / 1e9
    before, after = (each.setpoints for each in figures)
    row = {'activations': len(runs), **compared_answers(time, zero, figures, 1.0 / control.sample_rate)}
    if answers is not None:
        kept = [_settled(run.stamps, answers, run.from_its_beginning) for run in runs]
        row |= _agreement(time, before, np.concatenate(kept), all(run.from_its_beginning for run in runs))
    return Compared(row, Signals((stamps - zero) * 1e-9, displacement, (before, after)))


def _recorded_answers(recording: Recording, parameters: Parameters) -> RecordedAnswers | None:
    """Read the displacement, and return the recorded setpoints and traces, None where there are none."""
    quiet = quiet_at_first(parameters['mount_control'])
    wanted: dict[Topic, tuple[str, ...]] = {
        DISPLACEMENT: DISPLACEMENT.names,
        CURRENT_SETPOINT: CURRENT_SETPOINT.names,
        CONTROL_TRACE: tuple(dict.fromkeys(('displacement', 'bridged_samples', *quiet))),
    }
    there = {topic.name: names for topic, names in wanted.items() if has(recording, topic)}
    recording.load_columns(there)
    if CURRENT_SETPOINT.name not in there:
        return None
    traced, traces = np.empty(0, np.int64), {name: np.empty(0) for name in wanted[CONTROL_TRACE]}
    if CONTROL_TRACE.name in there:
        series = recording[CONTROL_TRACE.name]
        traced, places = each_once(series.stamps)
        traces = {name: series.columns[name][places] for name in traces if name in series.columns}
    setpoints = recording[CURRENT_SETPOINT.name]
    stamps, places = each_once(setpoints.stamps)
    return RecordedAnswers(stamps, setpoints['coil_current'][places], traced, traces, quiet)


def _settled(stamps: Times, answers: RecordedAnswers, from_its_beginning: bool) -> Column:
    """Return the recorded setpoints (A) from where on a replay can be expected to give them, else NaN."""
    recorded = looked_up(stamps, answers.stamps, answers.currents)[1]
    if from_its_beginning:
        return recorded
    return np.where(stamps - stamps[0] >= round(SETTLING * 1e9), recorded, math.nan)


def _agreement(time: Column, replayed: Column, recorded: Column, is_whole: bool) -> dict[str, Any]:
    """Return whether the replay without the change is what was recorded, nothing where nothing was.

    `is_whole`: the beginnings of all runs are in the recording.
    """
    found = difference(time, replayed, recorded)
    if not found.compared:
        return {}
    is_same = not found.differing or (not is_whole and abs(found.largest) <= SETTLED)
    return {'as_recorded': is_same, 'as_recorded_largest_a': abs(found.largest)}
