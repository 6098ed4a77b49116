"""Engine and mount simulated anew over a recorded acceleration, as recorded and with the change.

A recorded displacement answers the controller that was at work when it was recorded. What another one would
have done to it needs the loop to be closed again: the recorded acceleration of the chassis shakes a simulated
engine on a simulated mount, once with each controller, and these two are compared.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.core import ControlAnswers
from engine_mount.drives.inputs.consumed_samples import ReplayError
from engine_mount.drives.inputs.input import has
from engine_mount.drives.loop.messages import Samples
from engine_mount.drives.loop.run import CoreChain, run_core_into
from engine_mount.fleet.what_if.compared import Recorded, changed_parameters
from engine_mount.fleet.what_if.figures import AnswerFigures, DifferenceFigures, switching_row
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import session_parameters
from engine_mount.settings.chosen import control_parameters
from engine_mount.settings.options import with_sample_rate
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE, acceleration_at
from engine_mount.signals.signal import signal_of
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.control_loop import SampleCounts
from mount_control.policy.contract import Policy, trace_dtype
from mount_init.initialisation import InitialisationResult
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.quantity import with_flattened
from mount_ros.topics import SIM_CHASSIS_ACCELERATION
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.plant import TRUTH

Parameters = Mapping[str, Mapping[str, Any]]
Times = NDArray[np.int64]
Column = NDArray[np.float64]

_VERTICAL = 'linear_acceleration.z'
_COMPARED = ('setpoint', 'displacement')
"""What is kept of a drive so that another one can be compared with it, sample by sample."""
_PICTURED = (*_COMPARED, 'stamp', 'chassis_acceleration')
_OWN = ('scenario', 'faults', 'mounts', 'timeline.duration')  # parameters of the drive that was recorded
_MOTION = record_type([(name, 'f8') for name in ('count', 'square', 'peak', 'force_peak')])


def compared_motion(recorded: Recorded, changes: Parameters) -> dict[str, Any]:
    """Return the figures of two drives over the recorded acceleration, as columns of a row.

    The one is controlled as recorded, the other with `changes`; both begin with the rest in which the mount
    is initialised. Engine, mount and electronics are those of the session, or the defaults. Raises a
    `ValueError` with the reason where there are none.
    """
    sim, first, other = _both(recorded, changes, _COMPARED, ())
    sample_time = 1.0 / sim.sample_rate
    return {
        'duration_s': first.answers.samples * sample_time,
        'samples': first.answers.samples,
        'activations': 1,
        **other.difference.row(other.start),
        **first.answers.row(sample_time),
        **other.answers.row(sample_time, '_changed'),
        **switching_row(
            first.answers.switching(first.start), other.answers.switching(other.start), sample_time
        ),
        **first.motion(),
        **other.motion('_changed'),
        **other.moved(),
    }


@dataclass(frozen=True)
class Motion:
    """A simulated drive as signals (n,) over `time` (s from the beginning of the recorded acceleration).

    `acceleration` (m/s^2) is that of the chassis, `displacement` (m) that of the mount, `setpoint` in A.
    """

    time: Column
    acceleration: Column
    displacement: Column
    setpoint: Column


def both_motions(recorded: Recorded, changes: Parameters) -> tuple[Motion, Motion]:
    """Return the two drives that `compared_motion` compares: as recorded, and with `changes`."""
    _, first, other = _both(recorded, changes, _PICTURED, _PICTURED)
    return _motion(first), _motion(other)


def _motion(drive: '_Drive') -> Motion:
    time = (drive.column('stamp') - drive.start) * 1e-9
    return Motion(
        time, *(drive.column(name) for name in ('chassis_acceleration', 'displacement', 'setpoint'))
    )


def _both(
    recorded: Recorded, changes: Parameters, kept: Sequence[str], of_other: Sequence[str]
) -> tuple[SimParameters, '_Drive', '_Drive']:
    """Return the parameters of the simulator, the drive as recorded, and the one with `changes`."""
    after = _with_plant(recorded, changed_parameters(recorded, changes))
    before = _with_plant(recorded, recorded.parameters)
    sim = with_flattened(SimParameters(), before['mount_sim'])
    excitation = _shaken(recorded.recording, sim.timeline.start)
    first = _driven(before, excitation, kept)
    return sim, first, _driven(after, excitation, of_other, first)


def _with_plant(recorded: Recorded, parameters: Parameters) -> dict[str, Mapping[str, Any]]:
    """Return the parameters with those of the plant in which the recorded mount was simulated, if it was."""
    known = defaults_of_nodes()['mount_sim']
    told = session_parameters(recorded.session).get('mount_sim', {})
    plant = {name: value for name, value in told.items() if name in known and name not in _OWN}
    settings = {**parameters, **checked_settings({'mount_sim': plant})}
    return with_sample_rate(settings, control_parameters(parameters).sample_rate)


def _shaken(recording: Recording, start: float) -> Excitation:
    """Return the recorded acceleration under the engine from the time `start` (s) on."""
    if not has(recording, SIM_CHASSIS_ACCELERATION):
        raise ReplayError(
            f'{recording.path} holds no {SIM_CHASSIS_ACCELERATION.name}, which --closed-loop drives over: '
            'bring a measured one in with engine-mount import'
        )
    recording.load_columns({SIM_CHASSIS_ACCELERATION.name: (_VERTICAL,)})
    series = recording[SIM_CHASSIS_ACCELERATION.name]
    times = (series.stamps - series.stamps[0]) * 1e-9
    signal = signal_of(SIM_CHASSIS_ACCELERATION.name, times, series[_VERTICAL])
    values = acceleration_at(evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE), 1.0, STEP_TIME)
    return Excitation(Seat.ACCELERATED_CHASSIS, values, STEP_TIME, start)


def _driven(
    parameters: Parameters, excitation: Excitation, kept: Sequence[str], other: '_Drive | None' = None
) -> '_Drive':
    drive = _Drive(CoreChain(parameters).control.policy, round(excitation.start * 1e9), kept, other)
    run_core_into(drive, parameters, excitation=excitation)
    return drive


class _Drive:
    """Takes the samples of a drive from the stamp `start` (ns) on, and keeps the columns `kept` of them.

    With `other`, which kept `_COMPARED`, it takes the differences from that one.
    """

    def __init__(self, policy: Policy, start: int, kept: Sequence[str], other: '_Drive | None'):
        self.start = start
        self.answers, self.difference = AnswerFigures(), DifferenceFigures()
        self._trace, self._other = trace_dtype(policy), other
        self._kept: dict[str, list[NDArray[Any]]] = {name: [] for name in kept}
        self._displacements = DifferenceFigures()
        self._count, self._initialised = 0, False
        self._motion = np.zeros(1, _MOTION).view(np.uint8)

    def write_samples(self, samples: Samples) -> None:
        """Take the samples and empty the block."""
        part = slice(int(np.searchsorted(samples.stamps[: samples.count], self.start)), samples.count)
        if part.start < part.stop and self._initialised:
            self._take(samples, part)
        samples.count = 0

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        """Take the table with which the controller begins."""
        self.answers.begin_run(result.table)
        self._initialised = True

    def write_off(self, stamp: int) -> None:
        """Let the last setpoint pass."""

    def column(self, name: str) -> NDArray[Any]:
        """Return a column that is kept, (n,), from `start` on: A, m, m/s^2, or stamps in ns."""
        parts = self._kept[name]
        if len(parts) > 1:
            parts[:] = [np.concatenate(parts)]
        return parts[0]

    def motion(self, changed: str = '') -> dict[str, Any]:
        """Return the figures of the motion as columns, with `changed` before their unit."""
        now = self._motion.view(_MOTION)[0]
        return {
            f'peak_displacement{changed}_m': float(now['peak']),
            f'rms_displacement{changed}_m': math.sqrt(float(now['square']) / float(now['count'])),
            f'peak_mount_force{changed}_n': float(now['force_peak']),
        }

    def moved(self) -> dict[str, Any]:
        """Return how the motion differs from that of the other drive, as columns."""
        differences = self._displacements
        return {
            'displacement_difference_rms_m': differences.rms,
            'displacement_difference_largest_m': differences.largest,
            'displacement_difference_largest_at_s': differences.largest_at(self.start),
        }

    def _take(self, samples: Samples, part: slice) -> None:
        stamps, traced = samples.stamps[part].copy(), samples.traced[part].copy()
        setpoints = samples.setpoints[part].copy()
        traces = samples.traces[part].copy().view(self._trace)[:, 0]
        traces[~traced] = np.zeros(1, self._trace)[0]
        truth = samples.truths[part].view(TRUTH)[:, 0]
        _add_motion(self._motion, truth['displacement'], truth['mount_force'])
        self.answers.add(ControlAnswers(stamps, setpoints, traced, traces, SampleCounts()))
        displacement = truth['displacement'].copy()
        if self._other is not None:
            others = slice(self._count, self._count + len(stamps))
            self.difference.add(stamps, setpoints, self._other.column('setpoint')[others])
            self._displacements.add(stamps, displacement, self._other.column('displacement')[others])
        of_sample = {'stamp': stamps, 'setpoint': setpoints, 'displacement': displacement}
        for name, parts in self._kept.items():
            parts.append(of_sample[name] if name in of_sample else truth[name].copy())
        self._count += len(stamps)


@compiled
def _add_motion(motion, displacement, force):
    """Add displacements (m) and forces of the mount (N), both (n,), to the bytes of their sums."""
    now = motion.view(_MOTION)[0]
    for index in range(len(displacement)):
        now.count += 1.0
        now.square += displacement[index] * displacement[index]
        now.peak = max(now.peak, abs(displacement[index]))
        now.force_peak = max(now.force_peak, abs(force[index]))
