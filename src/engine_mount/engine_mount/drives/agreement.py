"""Whether a replay gives the recorded answers: matched by stamps, then judged as any two recordings are."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.core import ControlAnswers, Replayed
from engine_mount.drives.inputs.consumed_samples import ControlRun, Ramp, Times, places_in
from engine_mount.drives.inputs.input import ReplayInput
from engine_mount.recordings.difference import (
    EXACT,
    Column,
    Moment,
    SignalDifference,
    signal_difference,
    signal_sentences,
)
from engine_mount.recordings.events import Switching, paired_switchings, switching_times
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, Topic

# Where a recording begins in the middle of control: what the controller remembered is not in it. The
# band-pass forgets by e^-25 in 1 s, the friction deflection slowly; measured after 3 s: within 0.06 uA.
SETTLING = 3.0  # s, chosen
SETTLED = 1e-6  # A, chosen
_ACTIVE = 'damping_active'
_NAMES = ('the recording', 'the replay')


@dataclass(frozen=True)
class Agreement:
    """Recorded answers (A) against replayed ones (B); times in s on the recording's time axis."""

    setpoints: SignalDifference
    intermediates: tuple[SignalDifference, ...]
    settling_skipped: int  # setpoints not compared, because the recording begins in the middle of control

    @property
    def differing(self) -> list[SignalDifference]:
        """What is not the same to the bit: of setpoints and intermediates."""
        return [signal for signal in (self.setpoints, *self.intermediates) if signal.differing]

    @property
    def equal(self) -> bool:
        """Whether every compared setpoint and every intermediate is the same to the bit."""
        return not self.differing

    @property
    def agrees(self) -> bool:
        """Whether the answers are equal, or as near as a recording that begins in the middle allows."""
        if not self.settling_skipped or self.setpoints.unknown_in_one:
            return self.equal
        largest = self.setpoints.largest
        return largest is None or abs(largest.difference) <= SETTLED

    @property
    def sentences(self) -> list[str]:
        """How they differ, in words, the most important first."""
        steps = self.intermediates[0].samples if self.intermediates else 0
        count = self.setpoints.samples
        if self.equal:
            return [
                f'equal to the recorded setpoints to the last bit ({count} setpoints, '
                f'{steps} steps with all their intermediates)'
            ]
        told = signal_sentences(self.differing)
        if self.setpoints.differing:
            told.insert(0, f'{self.setpoints.differing} of {count} setpoints differ')
        return told


def agreement(given: ReplayInput, replayed: Replayed) -> Agreement | None:
    """Compare the replay with the recorded answers; None where there are none of its samples."""
    recorded = given.answers
    if recorded is None:
        return None
    settled = [_settled(part) for part in given.parts]
    stamps = np.concatenate([part.stamps for part in replayed.parts])
    currents = np.concatenate([part.setpoints for part in replayed.parts])
    found, places = places_in(recorded.stamps, stamps)
    judged = found & np.concatenate(settled)
    if not judged.any():
        return None
    steps = [
        (answers, answers.traced & mask)
        for answers, mask in zip(replayed.parts, settled, strict=True)
        if isinstance(answers, ControlAnswers)
    ]
    traced = np.concatenate([answers.stamps[mask] for answers, mask in steps])
    traces = np.concatenate([answers.traces[mask] for answers, mask in steps])
    known, at = places_in(recorded.trace_stamps, traced)
    return Agreement(
        setpoints=_difference(
            CURRENT_SETPOINT,
            'coil_current',
            given.seconds(stamps[judged]),
            recorded.currents[places[judged]],
            currents[judged],
        ),
        intermediates=tuple(
            _difference(
                CONTROL_TRACE, name, given.seconds(traced[known]), values[at[known]], traces[name][known]
            )
            for name, values in recorded.traces.items()
            if name in (traces.dtype.names or ())  # another policy traces something else
        ),
        settling_skipped=int(np.count_nonzero(found & ~judged)),
    )


def replayed_switching(given: ReplayInput, replayed: Replayed) -> Switching:
    """Return when the replay switched damping."""
    return _switching(
        given, [(run.stamps[run.traced], run.traces[_ACTIVE][run.traced]) for run in replayed.runs]
    )


def recorded_switching(given: ReplayInput) -> Switching | None:
    """Return when damping was switched in the recording; None where it holds no traces."""
    answers = given.answers
    if answers is None or not answers.trace_stamps.size or _ACTIVE not in answers.traces:
        return None
    inside = [
        (answers.trace_stamps >= run.stamps[0]) & (answers.trace_stamps <= run.stamps[-1])
        for run in given.controls
    ]
    return _switching(given, [(answers.trace_stamps[run], answers.traces[_ACTIVE][run]) for run in inside])


def switching_changes(recorded: Switching, replayed: Switching, sample_time: float) -> list[str]:
    """Return the switchings that appeared, vanished or moved, in words; `sample_time` in s."""
    a, b = ((np.array(times.on), np.array(times.off)) for times in (recorded, replayed))
    changes = paired_switchings(a, b, sample_time)
    return [change.sentence(*_NAMES) for change in changes if change.alone or change.moved]


def moment_figures(moment: Moment | None) -> dict[str, float | None] | None:
    """Return a difference as JSON has it: time in s, currents in A, unknown is None."""
    if moment is None:
        return None
    recorded, replayed = (None if math.isnan(value) else value for value in (moment.a, moment.b))
    return {'time_s': moment.time, 'recorded_a': recorded, 'replayed_a': replayed}


def _difference(topic: Topic, signal: str, time: NDArray, a: NDArray, b: NDArray) -> SignalDifference:
    unit = topic.unit(signal)
    return signal_difference(Column('', topic.name, signal, '' if unit == '1' else unit, time, a, b), EXACT)


def _settled(part: Ramp | ControlRun) -> NDArray[np.bool_]:
    """Return which samples of a part can be expected to be answered as they were recorded."""
    if isinstance(part, Ramp) or part.from_its_beginning:
        return np.ones(len(part.stamps), bool)
    return part.stamps - part.stamps[0] >= round(SETTLING * 1e9)


def _switching(given: ReplayInput, runs: list[tuple[Times, NDArray]]) -> Switching:
    times = [switching_times(given.seconds(stamps), active) for stamps, active in runs]
    return Switching(*(tuple(np.concatenate(each).tolist()) for each in zip(*times, strict=True)))
