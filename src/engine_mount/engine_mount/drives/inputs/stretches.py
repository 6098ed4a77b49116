"""The runs of the controller in a recording, stretch by stretch: hours need the memory of minutes.

A recording is divided only between two samples of which everything is recorded and that follow each other:
there no run begins, nothing is bridged and nothing is missing, so that what is found on either side does not
depend on the other. The stretches of all runs, one after the other, are the runs of `given.input`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.inputs.input import has
from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp
from engine_mount.drives.inputs.taken import (
    BREAK,
    Column,
    ControlRun,
    Notes,
    RecordedAnswers,
    ReplayError,
    Times,
    control_runs,
    looked_up,
    places_in,
)
from engine_mount.recordings.recording import Recording, column_parts
from engine_mount.recordings.series import Series
from mount_control.settings import ControlParameters
from mount_models.sampling import sample_time_ns
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, Topic

STRETCH = 30_000
"""Samples, chosen: half a minute, some 20 MB with what is made of it."""
_READ_AT_ONCE = 8192  # messages of a topic, chosen


class OutOfOrderError(ValueError):
    """A message came in long after those of its time: the recording is to be read whole."""


@dataclass(frozen=True)
class Stretch:
    """Samples of one run that follow each other: `run`, whether it `begins` here, and what was answered.

    `recorded` are the recorded setpoints (A), NaN where there is none.
    """

    run: ControlRun
    begins: bool
    recorded: Column


class Stretches:
    """Reads the stretches of a recording in the order of time.

    `quiet` are the names of what a trace holds as 0 in the first step of an empty memory.
    """

    def __init__(
        self,
        recording: Recording,
        gaps: Sequence[MeasuredGap],
        ramps: Sequence[Ramp],
        control: ControlParameters,
        quiet: tuple[str, ...],
    ):
        self._recording, self._gaps, self._ramps, self._control = recording, gaps, ramps, control
        self._quiet = quiet
        self._period = sample_time_ns(control.sample_rate)
        self._answered = has(recording, CURRENT_SETPOINT)
        self._traced = self._answered and has(recording, CONTROL_TRACE)
        self._notes = Notes()
        self.zero = 0
        """Stamp (ns) from which times are told; known once the first stretch was read."""

    def read(self, length: int = STRETCH) -> Iterator[Stretch]:
        """Yield all stretches, each of some `length` samples; 0: each run whole.

        Raises `ReplayError` where the recording cannot be replayed, `OutOfOrderError` where it cannot be
        divided.
        """
        if self._answered and not self._traced:
            length = 0  # whether the controller was active at all is known at the end only
        inside = False
        for window in self._windows(length):
            for run in control_runs(
                window.displacement, window.answers, self._ramps, self._gaps, self._control, self._notes
            ):
                recorded = np.full(len(run.stamps), np.nan)
                if window.answers is not None:
                    recorded = looked_up(run.stamps, window.answers.stamps, window.answers.currents)[1]
                yield Stretch(run, not (inside and window.divided), recorded)
                inside, window.divided = True, False

    def _windows(self, length: int) -> Iterator['_Window']:
        waiting = {topic.name: _Waiting(topic, names) for topic, names in self._columns().items()}
        displacement = waiting[DISPLACEMENT.name]
        divided, due = False, length
        names = {self._recording.resolve(name): name for name in waiting}
        wanted = {topic.name: columns for topic, columns in self._columns().items()}
        for part in column_parts(self._recording, wanted, min(length or _READ_AT_ONCE, _READ_AT_ONCE)):
            topic = names[part.topic]
            if topic == DISPLACEMENT.name:
                self._take_first(part, displacement)
                self._check_order(part, displacement)
            waiting[topic].add(part)
            if not length or displacement.count < due:
                continue
            cut = self._cut(waiting)
            due = length if cut is not None else displacement.count + length
            if cut is not None:
                yield self._window({name: each.until(cut) for name, each in waiting.items()}, divided)
                divided = True
        if displacement.count:
            yield self._window({name: each.until(None) for name, each in waiting.items()}, divided)

    def _columns(self) -> dict[Topic, tuple[str, ...]]:
        columns: dict[Topic, tuple[str, ...]] = {DISPLACEMENT: DISPLACEMENT.names}
        if self._answered:
            columns[CURRENT_SETPOINT] = CURRENT_SETPOINT.names
        if self._traced:
            columns[CONTROL_TRACE] = tuple(dict.fromkeys(('displacement', 'bridged_samples', *self._quiet)))
        return columns

    def _take_first(self, part: Series, displacement: '_Waiting') -> None:
        if displacement.newest is None and len(part):
            self.zero = self._notes.zero = self._recording.axis_from(part.stamps, part.receive_times).zero

    def _check_order(self, part: Series, displacement: '_Waiting') -> None:
        stamps = part.stamps
        if displacement.newest is not None:
            stamps = np.concatenate([[displacement.newest], stamps])
        back = np.flatnonzero(np.diff(stamps) < -BREAK)
        if back.size:
            raise ReplayError(
                f'{self._recording.path}: the time of the measurements goes back, from '
                f'{stamps[back[0]] / 1e9:.3f} s to {stamps[back[0] + 1] / 1e9:.3f} s; '
                'cut the recording there and replay the pieces'
            )

    def _window(self, columns: dict[str, tuple[Times, dict[str, Column]]], divided: bool) -> '_Window':
        stamps, values = columns[DISPLACEMENT.name]
        answers = None
        if self._answered:
            answered, currents = columns[CURRENT_SETPOINT.name]
            traced, traces = columns.get(CONTROL_TRACE.name, (np.empty(0, np.int64), {}))
            answers = RecordedAnswers(answered, currents['coil_current'], traced, traces, self._quiet)
        return _Window((stamps, values['mount']), answers, divided)

    def _cut(self, waiting: dict[str, '_Waiting']) -> int | None:
        """Return the stamp of the last sample before which the recording can be divided, None for none."""
        known = {name: each.columns() for name, each in waiting.items()}
        stamps = known[DISPLACEMENT.name][0]
        end = min((int(times[-1]) if len(times) else 0) for times, _ in known.values()) - BREAK
        sound = (np.diff(stamps) <= 1.5 * self._period) & (stamps[1:] <= end)
        sound &= stamps[:-1] > self._gaps[0].stamp
        for name in known.keys() - {DISPLACEMENT.name}:
            sound &= _both_known(stamps, known[name][0])
        if CONTROL_TRACE.name in known:
            times, traces = known[CONTROL_TRACE.name]
            moving = np.zeros(len(times), np.bool_)
            for name in self._quiet:
                moving |= traces[name] != 0.0 if name in traces else False
            at = places_in(times, stamps)[1]
            sound &= moving[at[:-1]] & moving[at[1:]] if len(times) else False
        places = np.flatnonzero(sound)
        return int(stamps[places[-1] + 1]) if places.size else None


@dataclass
class _Window:
    """What is between two cuts; `divided` from what came before."""

    displacement: tuple[Times, Column]
    answers: RecordedAnswers | None
    divided: bool


class _Waiting:
    """Columns of a topic that wait until the recording is divided behind them, each stamp once."""

    def __init__(self, topic: Topic, names: tuple[str, ...]):
        self.newest: int | None = None
        """Stamp (ns) of the message that came last."""
        self.count = 0
        self._name, self._names = topic.name, names
        self._stamps: list[Times] = []
        self._columns: dict[str, list[Column]] = {}
        self._cut: int | None = None

    def add(self, part: Series) -> None:
        """Take the messages that follow; raises `OutOfOrderError` for one of before the last cut."""
        stamps = part.stamps
        if not len(stamps):
            return
        if self._cut is not None and stamps.min() < self._cut:
            raise OutOfOrderError(f'{self._name} came in later than those behind it')
        if not self._columns:
            self._columns = {name: [] for name in self._names if name in part.columns}
        self._stamps.append(stamps)
        for name, parts in self._columns.items():
            parts.append(part.columns[name])
        self.newest, self.count = int(stamps[-1]), self.count + len(stamps)

    def columns(self) -> tuple[Times, dict[str, Column]]:
        """Return stamps (ns), rising, and columns; of a stamp that came twice the first."""
        stamps = np.concatenate([np.empty(0, np.int64), *self._stamps])
        columns = {name: np.concatenate([np.empty(0), *parts]) for name, parts in self._columns.items()}
        if not (np.diff(stamps) > 0).all():
            stamps, first = np.unique(stamps, return_index=True)
            columns = {name: column[first] for name, column in columns.items()}
        self._stamps, self._columns = [stamps], {name: [column] for name, column in columns.items()}
        self.count = len(stamps)
        return stamps, columns

    def until(self, cut: int | None) -> tuple[Times, dict[str, Column]]:
        """Return what is of before the stamp `cut` (ns), all for None, and keep the rest."""
        stamps, columns = self.columns()
        place = len(stamps) if cut is None else int(np.searchsorted(stamps, cut))
        # copies: a part would keep the whole in memory
        self._stamps = [stamps[place:].copy()]
        self._columns = {name: [column[place:].copy()] for name, column in columns.items()}
        self._cut, self.count = cut, len(stamps) - place
        return stamps[:place], {name: column[:place] for name, column in columns.items()}


def _both_known(stamps: Times, others: Times) -> NDArray[np.bool_]:
    """Return of each two neighbours in `stamps` whether they are neighbours in `others` too; both rise."""
    found, places = places_in(others, stamps)
    return found[:-1] & found[1:] & (np.diff(places) == 1)
