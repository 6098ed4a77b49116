"""One recording as recorded and with a change, both through the core controller, read in stretches."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from engine_mount.drives.agreement import SETTLED, SETTLING
from engine_mount.drives.core import ControlReplay, run_ramp
from engine_mount.drives.inputs.foreign import default_gap
from engine_mount.drives.inputs.input import dated, parameters_of, recorded_gaps, session_of
from engine_mount.drives.inputs.parameter_changes import recorded_changes, without
from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp, ramps_of
from engine_mount.drives.inputs.stretches import STRETCH, OutOfOrderError, Stretch, Stretches
from engine_mount.drives.inputs.taken import Column, ControlRun, Notes, ReplayError, quiet_at_first
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


def compared_setpoints(recorded: Recorded, changes: Parameters, length: int = STRETCH) -> dict[str, Any]:
    """Return the figures of a recording replayed as recorded and with `changes`, as columns of a row.

    It is read in stretches of some `length` samples, 0 for all at once; the figures are the same to the bit.
    Raises a `ValueError` with the reason where there are none.
    """
    try:
        return _Comparison(recorded, changes).row(length)
    except OutOfOrderError:
        return _Comparison(recorded, changes).row(0)


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
        quiet = quiet_at_first(recorded.parameters['mount_control'])
        self._stretches = Stretches(self._recording, self._gaps, ramps, self._control, quiet)

    def row(self, length: int) -> dict[str, Any]:
        """Replay all stretches; return the figures as columns."""
        sums, replays = _Sums(), None
        for stretch in self._stretches.read(length):
            if replays is None or stretch.begins:
                replays = self._begun(stretch.run, sums)
            _add(sums, replays, stretch)
        if replays is None:
            raise ReplayError(
                f'{self._recording.path}: no overlap of displacement and the time after the air_gap: '
                'the controller had nothing to do'
            )
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
        sample_time, zero = 1.0 / self._control.sample_rate, self._stretches.zero
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
    return dated(default_gap({}), 0) if recorded.session.get('scenario') == SCENARIO else None


def _add(sums: _Sums, replays: _Replays, stretch: Stretch) -> None:
    recorded = _settled(replays.run, stretch)
    for begin in range(0, len(recorded), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        stamps, displacement = stretch.run.stamps[part], stretch.run.displacement[part]
        before = replays.before.answer(stamps, displacement)
        after = replays.after.answer(stamps, displacement)
        sums.before.add(before)
        sums.after.add(after)
        sums.difference.add(stamps, after.setpoints, before.setpoints)
        sums.kept.add(stamps, before.setpoints, recorded[part])


def _settled(run: ControlRun, stretch: Stretch) -> Column:
    """Return the recorded setpoints (A) from where on a replay can be expected to give them, else NaN."""
    if run.from_its_beginning:
        return stretch.recorded
    settled = stretch.run.stamps - run.stamps[0] >= round(SETTLING * 1e9)
    return np.where(settled, stretch.recorded, math.nan)


def _as_recorded(sums: _Sums) -> bool | None:
    """Return whether the replay without the change is what was recorded, None where nothing was."""
    if not sums.kept.compared:
        return None
    return not sums.kept.differing or (not sums.whole and abs(sums.kept.largest) <= SETTLED)
