"""The figures of one row, summed sample by sample: the same to the bit in whatever parts they come."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.core import ControlAnswers
from engine_mount.recordings.events import Switching, paired_switchings, switching_times
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.interpolation import interpolated
from mount_models.arithmetic.record import record_type

Column = NDArray[np.float64]
Times = NDArray[np.int64]

_ANSWERS = record_type(
    [
        *((name, 'i8') for name in ('samples', 'answered', 'damping')),
        *(
            (name, 'f8')
            for name in ('current_sum', 'current_peak', 'force_square', 'force_peak', 'power_sum')
        ),
    ]
)
"""Sums over the answers of one controller: A, N, N^2, W."""

_DIFFERENCE = record_type(
    [
        *((name, 'i8') for name in ('compared', 'differing', 'first_stamp', 'largest_stamp')),
        *((name, 'f8') for name in ('square', 'largest')),
    ]
)
"""Sums over the differences (A) of two rows of setpoints; stamps in ns."""


class AnswerFigures:
    """What one controller did: setpoints, damping, and the friction that its force model predicts."""

    def __init__(self) -> None:
        self._sums = np.zeros(1, _ANSWERS).view(np.uint8)
        self._runs: list[_Changes] = []
        self._table: tuple[Column, ...] = ()

    def begin_run(self, table: tuple[Column, Column]) -> None:
        """Note that the controller was activated anew, with a `table` of current (A) and normal force (N)."""
        self._runs.append(_Changes())
        self._table = tuple(np.array(column, np.float64) for column in table)

    def add(self, answers: ControlAnswers) -> None:
        """Take answers in the order of their samples."""
        traces = answers.traces
        names = ('damping_active', 'friction_coefficient', 'desired_force', 'velocity')
        _add_answers(self._sums, self._table, answers.setpoints, *(traces[name] for name in names))
        self._runs[-1].add(answers.stamps[answers.traced], traces['damping_active'][answers.traced])

    @property
    def samples(self) -> int:
        """How many samples there were."""
        return int(self._record['samples'])

    def switching(self, zero: int) -> Switching:
        """Return when damping was switched, in s from the stamp `zero` (ns) on."""
        times = [run.switching(zero) for run in self._runs]
        return Switching(*(tuple(np.concatenate(each).tolist()) for each in zip(*times, strict=True)))

    def row(self, sample_time: float, changed: str = '') -> dict[str, Any]:
        """Return the figures as columns, with `changed` (`_changed`) before their unit."""
        sums = self._record
        samples, answered = int(sums['samples']), int(sums['answered'])
        mean = float(sums['current_sum']) / answered if answered else math.nan
        rms = math.sqrt(float(sums['force_square']) / samples) if samples else math.nan
        return {
            f'peak_current{changed}_a': float(sums['current_peak']) if answered else math.nan,
            f'mean_current{changed}_a': mean,
            f'damping{changed}_s': int(sums['damping']) * sample_time,
            f'peak_friction{changed}_n': float(sums['force_peak']),
            f'rms_friction{changed}_n': rms,
            f'pad_energy{changed}_j': float(sums['power_sum']) * sample_time,
        }

    @property
    def _record(self) -> Any:
        return self._sums.view(_ANSWERS)[0]


class DifferenceFigures:
    """How setpoints differ from others to the same samples, A; NaN is compared with nothing."""

    def __init__(self) -> None:
        self._sums = np.zeros(1, _DIFFERENCE).view(np.uint8)

    def add(self, stamps: Times, setpoints: Column, others: Column) -> None:
        """Take setpoints (A) and those from which they may differ, in the order of their stamps (ns)."""
        _add_differences(self._sums, stamps, setpoints, others)

    @property
    def compared(self) -> int:
        """How many were compared."""
        return int(self._record['compared'])

    @property
    def differing(self) -> int:
        """How many of them were others."""
        return int(self._record['differing'])

    @property
    def largest(self) -> float:
        """The largest difference with its sign, A; NaN where nothing was compared."""
        return float(self._record['largest']) if self.compared else math.nan

    @property
    def rms(self) -> float:
        """Rms of all differences, A; NaN where nothing was compared."""
        return math.sqrt(float(self._record['square']) / self.compared) if self.compared else math.nan

    def largest_at(self, zero: int) -> float:
        """Return when the largest difference was, in s from the stamp `zero` (ns) on; NaN without any."""
        return (int(self._record['largest_stamp']) - zero) / 1e9 if self.differing else math.nan

    def row(self, zero: int) -> dict[str, Any]:
        """Return the figures as columns; times in s from the stamp `zero` (ns) on."""
        first = (int(self._record['first_stamp']) - zero) / 1e9
        return {
            'setpoints_differing': self.differing,
            'setpoint_difference_rms_a': self.rms,
            'setpoint_difference_largest_a': self.largest,
            'setpoint_difference_largest_at_s': self.largest_at(zero),
            'setpoint_difference_first_at_s': first if self.differing else math.nan,
        }

    @property
    def _record(self) -> Any:
        return self._sums.view(_DIFFERENCE)[0]


def switching_row(before: Switching, after: Switching, sample_time: float) -> dict[str, Any]:
    """Return which switchings of damping appeared, vanished or moved, as columns."""
    a, b = ((np.array(times.on), np.array(times.off)) for times in (before, after))
    changes = paired_switchings(a, b, sample_time)
    moved = [change.moved for change in changes if change.moved]
    return {
        'switched_on': len(before.on),
        'switched_on_changed': len(after.on),
        'switchings_appeared': sum(change.time_a is None for change in changes),
        'switchings_vanished': sum(change.time_b is None for change in changes),
        'switchings_moved': len(moved),
        'switching_moved_furthest_s': max(moved, key=abs, default=math.nan),
    }


class _Changes:
    """Where damping changed in one run of the controller: all that its switching times are told by."""

    def __init__(self) -> None:
        self._stamps: list[Times] = []
        self._states: list[NDArray[np.bool_]] = []
        self._state = False

    def add(self, stamps: Times, active: Column) -> None:
        """Take the steps that follow: stamps (ns), and how far damping was open."""
        states = active > 0.0
        places = np.flatnonzero(np.diff(states, prepend=self._state))
        self._stamps.append(stamps[places])
        self._states.append(states[places])
        self._state = bool(states[-1]) if len(states) else self._state

    def switching(self, zero: int) -> tuple[Column, Column]:
        """Return when damping went on and off, s from the stamp `zero` (ns) on."""
        stamps = np.concatenate([np.empty(0, np.int64), *self._stamps])
        states = np.concatenate([np.empty(0, np.bool_), *self._states])
        return switching_times((stamps - zero) / 1e9, states.astype(np.float64))


@compiled
def _add_answers(sums, table, currents, active, coefficients, desired_forces, velocities):
    """Add the answers (n,) to `sums`, the bytes of its record; what was not traced is 0.

    The friction is that at the normal force of the setpoint, which may be held below the wanted one.
    """
    now = sums.view(_ANSWERS)[0]
    for index in range(len(currents)):
        now.samples += 1
        current = currents[index]
        if not math.isnan(current):
            now.answered += 1
            now.current_sum += current
            now.current_peak = max(now.current_peak, current)
        if not active[index] > 0.0:
            continue
        now.damping += 1
        force = coefficients[index] * interpolated(current, table[0], table[1])
        if math.isnan(force):
            continue
        now.force_square += force * force
        now.force_peak = max(now.force_peak, force)
        # with the sign of the wanted force: the noise of the velocity, whose sign is as often wrong, cancels
        now.power_sum += math.copysign(force, desired_forces[index]) * velocities[index]


@compiled
def _add_differences(sums, stamps, setpoints, others):
    """Add the differences (n,) to `sums`, the bytes of its record."""
    now = sums.view(_DIFFERENCE)[0]
    for index in range(len(stamps)):
        difference = setpoints[index] - others[index]
        if math.isnan(difference):
            continue
        now.compared += 1
        if difference == 0.0:
            continue
        if now.differing == 0:
            now.first_stamp = stamps[index]
        now.differing += 1
        now.square += difference * difference
        if abs(difference) > abs(now.largest):
            now.largest = difference
            now.largest_stamp = stamps[index]
