"""The figures of one row, from setpoints and traces; sums are in the order of the samples."""

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.core import ControlAnswers
from engine_mount.recordings.events import paired_switchings, switching_times
from mount_models.arithmetic.sums import each_interpolated

Column = NDArray[np.float64]
Times = NDArray[np.int64]


class AnswerFigures:
    """What one controller did: setpoints, damping, and the friction that its force model predicts."""

    def __init__(self) -> None:
        self._columns: dict[str, list[Column]] = defaultdict(list)
        self._steps: list[
            list[tuple[Times, Column]]
        ] = []  # of each run: stamps (ns), how far damping is open
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
            self._columns[name].append(column)
        steps = answers.traces['damping_active'][answers.traced]
        self._steps[-1].append((answers.stamps[answers.traced], steps))
        self._columns['damped'].append(is_damped)

    @property
    def setpoints(self) -> Column:
        """The setpoints (A) of all samples."""
        return self._column('setpoint')

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
        setpoints, force = self.setpoints, self._column('force')
        known = setpoints[~np.isnan(setpoints)]
        return {
            f'peak_current{changed}_a': known.max(initial=0.0) if known.size else math.nan,
            f'mean_current{changed}_a': ordered_sum(known) / known.size if known.size else math.nan,
            f'damping{changed}_s': np.count_nonzero(self._column('damped')) * sample_time,
            f'peak_friction{changed}_n': force.max(initial=0.0),
            f'rms_friction{changed}_n': math.sqrt(ordered_sum(force * force) / setpoints.size),
            f'pad_energy{changed}_j': ordered_sum(self._column('power')) * sample_time,
        }

    def _column(self, name: str) -> Column:
        return np.concatenate(self._columns[name])


class Difference(NamedTuple):
    """How values differ from others: counts, rms, the largest with its sign, and times in s; else NaN."""

    compared: int
    differing: int
    rms: float
    largest: float
    largest_at: float
    first_at: float


def difference(time: Column, values: Column, others: Column) -> Difference:
    """Return how `values` differ from `others`, both (n,) over `time` (s); NaN is compared with nothing."""
    differences = values - others
    known = ~np.isnan(differences)
    time, differences = time[known], differences[known]
    compared, places = differences.size, np.flatnonzero(differences)
    if not compared:
        return Difference(0, 0, *[math.nan] * 4)
    largest = int(np.argmax(np.abs(differences)))
    return Difference(
        compared,
        places.size,
        math.sqrt(ordered_sum(differences * differences) / compared),
        float(differences[largest]),
        float(time[largest]) if places.size else math.nan,
        float(time[places[0]]) if places.size else math.nan,
    )


def compared_answers(
    time: Column, zero: int, answers: Sequence[AnswerFigures], sample_time: float
) -> dict[str, Any]:
    """Return what two controllers did and how it differs, as columns: as recorded, and with the change.

    `time` (s) of their samples counts from the stamp `zero` (ns), `sample_time` in s.
    """
    before, after = answers
    setpoints = difference(time, after.setpoints, before.setpoints)
    on_and_off = [each.switching(zero) for each in answers]
    changes = paired_switchings(*on_and_off, sample_time)
    moved = [change.moved for change in changes if change.moved]
    return {
        'duration_s': time.size * sample_time,
        'samples': time.size,
        'setpoints_differing': setpoints.differing,
        'setpoint_difference_rms_a': setpoints.rms,
        'setpoint_difference_largest_a': setpoints.largest,
        'setpoint_difference_largest_at_s': setpoints.largest_at,
        'setpoint_difference_first_at_s': setpoints.first_at,
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
