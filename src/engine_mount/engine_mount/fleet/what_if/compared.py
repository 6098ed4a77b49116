"""One recording as recorded and with a change, both through the core controller."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from engine_mount.drives.agreement import SETTLED, SETTLING
from engine_mount.drives.core import ControlReplay, run_ramp
from engine_mount.drives.inputs.consumed_samples import (
    Column,
    ControlRun,
    MeasuredGap,
    Notes,
    Ramp,
    RecordedAnswers,
    ReplayError,
    control_runs,
    looked_up,
    quiet_at_first,
)
from engine_mount.drives.inputs.foreign import default_gap
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
from engine_mount.fleet.what_if.figures import AnswerFigures, DifferenceFigures, switching_row
from engine_mount.recordings.recording import Recording
from engine_mount.settings.chosen import check_effect, control_parameters
from engine_mount.signals.importing.provenance import SCENARIO
from mount_ros import topics

Parameters = Mapping[str, Mapping[str, Any]]

_AT_ONCE = 4096  # samples, chosen: their traces, 0.8 MB, stay in the processor's cache until they are summed
_SELDOM = (topics.AIR_GAP, topics.CURRENT_FORCE_TABLE, topics.SESSION, topics.EVENT)


@dataclass
class Recorded:
    """What a recording says of its controller, beside its samples."""

    recording: Recording
    session: dict[str, Any]
    parameters: dict[str, dict[str, Any]]

    @property
    def version(self) -> str:
        """With which version of this project it was made, empty where it does not tell."""
        told = self.session.get('versions')
        return str(told.get('mount_bringup', '')) if isinstance(told, Mapping) else ''


def recorded_in(recording: Recording) -> Recorded:
    """Read what a recording says beside its samples, not the whole of it; raises a `ValueError`."""
    recording.load(topic.name for topic in _SELDOM if topic.name in recording)
    notes = Notes()
    session = session_of(recording, notes)
    return Recorded(recording, session, parameters_of(session, notes))


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


def compared_setpoints(recorded: Recorded, changes: Parameters) -> dict[str, Any]:
    """Return the figures of a recording replayed as recorded and with `changes`, as columns of a row.

    Raises a `ValueError` with the reason where there are none.
    """
    return _Comparison(recorded, changes).row()


@dataclass
class _Replays:
    """The run of the controller that is under way, as recorded and with the change."""

    run: ControlRun
    before: ControlReplay
    after: ControlReplay


@dataclass
class _Sums:
    """What is summed over all stretches; `kept`: of the replay as recorded against the recorded setpoints."""

    before: AnswerFigures = field(default_factory=AnswerFigures)
    after: AnswerFigures = field(default_factory=AnswerFigures)
    difference: DifferenceFigures = field(default_factory=DifferenceFigures)
    kept: DifferenceFigures = field(default_factory=DifferenceFigures)
    runs: int = 0
    whole: bool = True  # whether the beginnings of all runs are in the recording


class _Comparison:
    def __init__(self, recorded: Recorded, changes: Parameters):
        self._recording, self._parameters = recorded.recording, recorded.parameters
        self._changed = changed_parameters(recorded, changes)
        self._control = control_parameters(recorded.parameters)
        self._gaps = recorded_gaps(self._recording, _assumed_gap(recorded))
        ramps = self._ramps('mount_init' in changes)
        self._changed_gaps = self._initialised(ramps) if 'mount_init' in changes else {}
        self._told = recorded_changes(self._recording)
        self._changed_told = without(self._told, changes.get('mount_control', {}))
        self._answers = _recorded_answers(self._recording, recorded.parameters)
        self._runs = control_runs(
            displacement_of(self._recording), self._answers, ramps, self._gaps, self._control, Notes()
        )

    def row(self) -> dict[str, Any]:
        """Replay all runs; return the figures as columns."""
        if not self._runs:
            raise ReplayError(
                f'{self._recording.path}: no overlap of displacement and the time after the air_gap: '
                'the controller had nothing to do'
            )
        sums = _Sums()
        for run in self._runs:
            recorded = np.full(len(run.stamps), math.nan)
            if self._answers is not None:
                recorded = looked_up(run.stamps, self._answers.stamps, self._answers.currents)[1]
            _add(sums, self._begun(run, sums), recorded)
        return self._told_as_row(sums)

    def _ramps(self, replayed: bool) -> Sequence[Ramp]:
        """Return the initialisations, where one is replayed or lies between two runs of the controller."""
        if not replayed and len(self._gaps) == 1:
            return ()
        return ramps_of(self._recording, self._parameters, self._gaps, Notes())

    def _initialised(self, ramps: Sequence[Ramp]) -> dict[int, MeasuredGap]:
        """Return what the changed initialisation measures, by the stamp (ns) of its end."""
        if not ramps:
            raise ReplayError(
                'there is no initialisation to replay, so parameters of mount_init change nothing'
            )
        found = [run_ramp(ramp, self._changed).gap for ramp in ramps]
        return {gap.stamp: gap for gap in found}

    def _begun(self, run: ControlRun, sums: _Sums) -> _Replays:
        first = int(run.stamps[0])
        gap = self._changed_gaps.get(run.gap.stamp, run.gap)
        sums.before.begin_run((run.gap.table.current, run.gap.table.normal_force))
        sums.after.begin_run((gap.table.current, gap.table.normal_force))
        sums.runs += 1
        sums.whole &= run.from_its_beginning
        return _Replays(
            run,
            ControlReplay(first, run.gap, self._parameters, self._told),
            ControlReplay(first, gap, self._changed, self._changed_told),
        )

    def _told_as_row(self, sums: _Sums) -> dict[str, Any]:
        sample_time, zero = 1.0 / self._control.sample_rate, self._recording.time_axis.zero
        before, after = sums.before.switching(zero), sums.after.switching(zero)
        return {
            'duration_s': sums.before.samples * sample_time,
            'samples': sums.before.samples,
            'activations': sums.runs,
            'as_recorded': _as_recorded(sums),
            'as_recorded_largest_a': abs(sums.kept.largest),
            **sums.difference.row(zero),
            **sums.before.row(sample_time),
            **sums.after.row(sample_time, '_changed'),
            **switching_row(before, after, sample_time),
        }


def _assumed_gap(recorded: Recorded) -> MeasuredGap | None:
    """Return the nominal gap where the recording was made of files of others, which hold none."""
    return default_gap({}).dated(0) if recorded.session.get('scenario') == SCENARIO else None


def _recorded_answers(recording: Recording, parameters: Parameters) -> RecordedAnswers | None:
    """Read the displacement, and return the recorded setpoints and traces, None where there are none."""
    quiet = quiet_at_first(parameters['mount_control'])
    traced = tuple(dict.fromkeys(('displacement', 'bridged_samples', *quiet)))
    wanted = {
        topics.DISPLACEMENT: topics.DISPLACEMENT.names,
        topics.CURRENT_SETPOINT: topics.CURRENT_SETPOINT.names,
        topics.CONTROL_TRACE: traced,
    }
    there = {topic.name: names for topic, names in wanted.items() if has(recording, topic)}
    recording.load_columns(there)
    if topics.CURRENT_SETPOINT.name not in there:
        return None
    stamps, traces = np.empty(0, np.int64), {name: np.empty(0) for name in traced}
    if topics.CONTROL_TRACE.name in there:
        series = recording[topics.CONTROL_TRACE.name]
        stamps, places = np.unique(series.stamps, return_index=True)
        traces = {name: series.columns[name][places] for name in traced if name in series.columns}
    setpoints = recording[topics.CURRENT_SETPOINT.name]
    answered, places = np.unique(setpoints.stamps, return_index=True)
    return RecordedAnswers(answered, setpoints['coil_current'][places], stamps, traces, quiet)


def _add(sums: _Sums, replays: _Replays, recorded: Column) -> None:
    """Replay a run and add its figures; `recorded`: its recorded setpoints (A), NaN where there is none."""
    run, settled = replays.run, recorded
    if not run.from_its_beginning:  # from where on a replay can be expected to give them
        settled = np.where(run.stamps - run.stamps[0] >= round(SETTLING * 1e9), recorded, math.nan)
    for begin in range(0, len(recorded), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        stamps, displacement = run.stamps[part], run.displacement[part]
        before = replays.before.answer(stamps, displacement)
        after = replays.after.answer(stamps, displacement)
        sums.before.add(before)
        sums.after.add(after)
        sums.difference.add(stamps, after.setpoints, before.setpoints)
        sums.kept.add(stamps, before.setpoints, settled[part])


def _as_recorded(sums: _Sums) -> bool | None:
    """Return whether the replay without the change is what was recorded, None where nothing was."""
    if not sums.kept.compared:
        return None
    return not sums.kept.differing or (not sums.whole and abs(sums.kept.largest) <= SETTLED)
