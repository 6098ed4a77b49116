"""One recording as recorded and with a change, both through the core controller; the figures of its row.

Sums are in the order of the samples.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.agreement import SETTLED, SETTLING
from engine_mount.drives.core import ControlAnswers, ControlReplay
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
from engine_mount.drives.inputs.input import (
    default_gap,
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
from engine_mount.recordings.events import paired_switchings, switching_times
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.times import each_once
from engine_mount.reports.fleet.looks import Signals
from engine_mount.settings.chosen import check_effect, control_parameters
from engine_mount.signals.channels import SCENARIO
from mount_models.arithmetic.sums import each_interpolated
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
    if 'mount_init' in changes:
        raise ReplayError(
            'parameters of mount_init change nothing that a fleet replays; try them with --closed-loop, '
            'or on one recording with engine-mount replay'
        )
    recording, parameters = recorded.recording, recorded.parameters
    changed = changed_parameters(recorded, changes)
    is_imported = recorded.session.get('scenario') == SCENARIO  # such a recording holds no gap
    gaps = recorded_gaps(recording, default_gap({}).dated(0) if is_imported else None)
    # a ramp is of interest between two runs of the controller only
    ramps = ramps_of(recording, parameters, gaps, Notes()) if len(gaps) > 1 else []
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
        first, table = int(run.stamps[0]), run.gap.table
        replays = (
            ControlReplay(first, run.gap, parameters, told),
            ControlReplay(first, run.gap, changed, of_changed),
        )
        for each in figures:
            each.begin_run(table.current, table.normal_force)
        for begin in range(0, len(run.stamps), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            for each, replay in zip(figures, replays, strict=True):
                each.add(replay.answer(run.stamps[part], run.displacement[part], run.crank_frequency[part]))
    stamps = np.concatenate([run.stamps for run in runs])
    displacement = np.concatenate([run.displacement for run in runs])
    zero = recording.time_axis.zero
    time = (stamps - zero) / 1e9
    before, after = (each.setpoints for each in figures)
    row = {'activations': len(runs), **compared_answers(time, zero, figures, 1.0 / control.sample_rate)}
    if answers is not None:
        kept = [_settled(run.stamps, answers, run.from_its_beginning) for run in runs]
        row |= _agreement(before, np.concatenate(kept), all(run.from_its_beginning for run in runs))
    return Compared(row, Signals((stamps - zero) * 1e-9, displacement, (before, after)))


def _recorded_answers(recording: Recording, parameters: Parameters) -> RecordedAnswers | None:
    """Read the displacement, and return the recorded setpoints and traces, None where there are none."""
    quiet = quiet_at_first(parameters['mount_control'])
    wanted: dict[Topic, tuple[str, ...]] = {
        DISPLACEMENT: DISPLACEMENT.names,
        CURRENT_SETPOINT: CURRENT_SETPOINT.names,
        CONTROL_TRACE: tuple(dict.fromkeys(('displacement', 'crank_frequency', 'bridged_samples', *quiet))),
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


def _agreement(replayed: Column, recorded: Column, is_whole: bool) -> dict[str, Any]:
    """Return whether the replay without the change is what was recorded, nothing where nothing was.

    `is_whole`: the beginnings of all runs are in the recording.
    """
    distances = np.abs(replayed - recorded)
    if np.isnan(distances).all():
        return {}
    largest = float(np.nanmax(distances))
    return {'as_recorded': largest <= (0.0 if is_whole else SETTLED), 'as_recorded_largest_a': largest}


class AnswerFigures:
    """What one controller did: setpoints, damping, and the friction that its force model predicts."""

    def __init__(self) -> None:
        self.columns: dict[str, list[NDArray[Any]]] = defaultdict(list)
        """Blocks of samples by name."""
        self._steps: list[list[tuple[Times, Column]]] = []  # of each run: stamps (ns), degree of damping
        self._table: Sequence[Column] = ()

    def begin_run(self, current: Column, normal_force: Column) -> None:
        """Note that the controller was activated anew, with a table (A, N)."""
        self._steps.append([])
        self._table = [np.array(column, np.float64) for column in (current, normal_force)]

    def add(self, answers: ControlAnswers) -> None:
        """Take answers in the order of their samples; a trace that was not made is 0.

        The friction is that at the normal force of the setpoint, which may be held below the wanted one.
        """
        is_damped = answers.traces['damping_active'] > 0.0
        traces = answers.traces[is_damped]
        force = traces['friction_coefficient'] * each_interpolated(answers.setpoints[is_damped], *self._table)
        known = ~np.isnan(force)
        # with the sign of the wanted force: the noise of the velocity, whose sign is as often wrong, cancels
        power = np.copysign(force, traces['desired_force']) * traces['velocity']
        columns = {'setpoint': answers.setpoints, 'force': force[known], 'power': power[known]}
        for name, column in columns.items():
            self.columns[name].append(column)
        steps = answers.traces['damping_active'][answers.traced]
        self._steps[-1].append((answers.stamps[answers.traced], steps))
        self.columns['damped'].append(is_damped)

    @property
    def setpoints(self) -> Column:
        """The setpoints (A) of all samples."""
        return self.column('setpoint')

    def switching(self, zero: int) -> tuple[Column, Column]:
        """Return when damping went on and off, s from the stamp `zero` (ns) on."""
        found = []
        for run in self._steps:
            stamps, active = (np.concatenate(each) for each in zip(*run, strict=True))
            found.append(switching_times((stamps - zero) / 1e9, active))
        on, off = (np.concatenate(each) for each in zip(*found, strict=True))
        return on, off

    def row(self, sample_time: float, changed: str = '') -> dict[str, Any]:
        """Return the figures as columns, with `changed` (`_changed`) before their unit."""
        setpoints, force = self.setpoints, self.column('force')
        known = setpoints[~np.isnan(setpoints)]
        return {
            f'peak_current{changed}_a': known.max(initial=0.0) if known.size else math.nan,
            f'mean_current{changed}_a': ordered_sum(known) / known.size if known.size else math.nan,
            f'damping{changed}_s': np.count_nonzero(self.column('damped')) * sample_time,
            f'peak_friction{changed}_n': force.max(initial=0.0),
            f'rms_friction{changed}_n': math.sqrt(ordered_sum(force * force) / setpoints.size),
            f'pad_energy{changed}_j': ordered_sum(self.column('power')) * sample_time,
        }

    def column(self, name: str) -> NDArray[Any]:
        """Return a column (n,) of the samples."""
        return np.concatenate(self.columns[name])


def difference(what: str, unit: str, time: Column, values: Column, others: Column) -> dict[str, float]:
    """Return how `values` differ from `others`, both (n,) over `time` (s), as columns of `what` in `unit`.

    NaN is compared with nothing; the largest difference has its sign.
    """
    differences = values - others
    known = ~np.isnan(differences)
    time, differences = time[known], differences[known]
    count, largest = differences.size, int(np.argmax(np.abs(differences))) if known.any() else 0
    return {
        f'{what}_rms_{unit}': math.sqrt(ordered_sum(differences * differences) / count)
        if count
        else math.nan,
        f'{what}_largest_{unit}': float(differences[largest]) if count else math.nan,
        f'{what}_largest_at_s': float(time[largest]) if differences.any() else math.nan,
    }


def compared_answers(
    time: Column, zero: int, answers: Sequence[AnswerFigures], sample_time: float
) -> dict[str, Any]:
    """Return what two controllers did and how it differs, as columns: as recorded, and with the change.

    `time` (s) of their samples counts from the stamp `zero` (ns), `sample_time` in s.
    """
    before, after = answers
    differing = np.flatnonzero(np.nan_to_num(after.setpoints - before.setpoints))
    on_and_off = [each.switching(zero) for each in answers]
    changes = paired_switchings(*on_and_off, sample_time)
    moved = [change.moved for change in changes if change.moved]
    return {
        'duration_s': time.size * sample_time,
        'samples': time.size,
        'setpoints_differing': differing.size,
        **difference('setpoint_difference', 'a', time, after.setpoints, before.setpoints),
        'setpoint_difference_first_at_s': float(time[differing[0]]) if differing.size else math.nan,
        **before.row(sample_time),
        **after.row(sample_time, '_changed'),
        'switched_on': len(on_and_off[0][0]),
        'switched_on_changed': len(on_and_off[1][0]),
        'switchings_appeared': sum(change.time_a is None for change in changes),
        'switchings_vanished': sum(change.time_b is None for change in changes),
        'switchings_moved': len(moved),
        'switching_moved_furthest_s': max(moved, key=abs, default=math.nan),
    }


def ordered_sum(values: Column) -> float:
    """Return the sum of values (n,), added one after the other: `np.sum` has no order of its own."""
    return float(np.cumsum(values)[-1]) if values.size else 0.0
