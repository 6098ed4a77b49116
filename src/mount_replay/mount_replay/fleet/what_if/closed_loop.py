"""Engine and mount simulated anew over a recorded acceleration, as recorded and with the change.

A recorded displacement answers the controller that was at work when it was recorded. What another one would
have done to it needs the loop to be closed again: the recorded acceleration of the chassis shakes a simulated
engine on a simulated mount, once with each controller, and these two are compared.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.bag.recording import Recording
from mount_bags.run.session import session_parameters
from mount_bags.signals.even_grid import evenly_spaced
from mount_bags.signals.signal import signal_of
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.policy.contract import Policy, trace_dtype
from mount_control.sample_watch import SampleCounts
from mount_init.initialisation import InitialisationResult
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.quantity import with_flattened
from mount_replay.core import ControlAnswers
from mount_replay.fleet.what_if.compared import Recorded, changed_parameters
from mount_replay.fleet.what_if.figures import AnswerFigures, DifferenceFigures, switching_row
from mount_replay.given.input import has
from mount_replay.given.taken import ReplayError
from mount_replay.loop.chain import CoreChain
from mount_replay.loop.messages import Samples
from mount_replay.loop.run import run_core_into
from mount_ros.topics import SIM_CHASSIS_ACCELERATION
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.recorded import LONGEST_GAP, LOWEST_RATE, acceleration_at
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.plant import TRUTH

Parameters = Mapping[str, Mapping[str, Any]]
Times = NDArray[np.int64]
Column = NDArray[np.float64]

_VERTICAL = 'linear_acceleration.z'
_OWN = ('scenario', 'faults', 'mounts', 'timeline.duration')  # parameters of the drive that was recorded
_MOTION = record_type([(name, 'f8') for name in ('count', 'square', 'peak', 'force_peak')])


def compared_motion(recorded: Recorded, changes: Parameters) -> dict[str, Any]:
    """Return the figures of two drives over the recorded acceleration, as columns of a row.

    The one is controlled as recorded, the other with `changes`; both begin with the rest in which the mount
    is initialised. Engine, mount and electronics are those of the session, or the defaults. Raises a
    `ValueError` with the reason where there are none.
    """
    after = _with_plant(recorded, changed_parameters(recorded, changes))
    before = _with_plant(recorded, recorded.parameters)
    sim = with_flattened(SimParameters(), before['mount_sim'])
    excitation = _shaken(recorded.recording, sim.timeline.start)
    first = _driven(before, excitation, None)
    other = _driven(after, excitation, first)
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
    }


def _with_plant(recorded: Recorded, parameters: Parameters) -> dict[str, Mapping[str, Any]]:
    """Return the parameters with those of the plant in which the recorded mount was simulated, if it was."""
    known = defaults_of_nodes()['mount_sim']
    told = session_parameters(recorded.session).get('mount_sim', {})
    plant = {name: value for name, value in told.items() if name in known and name not in _OWN}
    return {**parameters, **checked_settings({'mount_sim': plant})}


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


def _driven(parameters: Parameters, excitation: Excitation, other: '_Drive | None') -> '_Drive':
    drive = _Drive(CoreChain(parameters).policy, round(excitation.start * 1e9), other)
    run_core_into(drive, parameters, excitation=excitation)
    return drive


class _Drive:
    """Takes the samples of a drive from the stamp `start` (ns) on; with `other`, the differences from it."""

    def __init__(self, policy: Policy, start: int, other: '_Drive | None'):
        self.start = start
        self.answers, self.difference = AnswerFigures(), DifferenceFigures()
        self._trace, self._other = trace_dtype(policy), other
        self._setpoints: list[Column] = []
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

    @property
    def setpoints(self) -> Column:
        """All setpoints (A) from `start` on."""
        if len(self._setpoints) > 1:
            self._setpoints = [np.concatenate(self._setpoints)]
        return self._setpoints[0]

    def motion(self, changed: str = '') -> dict[str, Any]:
        """Return the figures of the motion as columns, with `changed` before their unit."""
        now = self._motion.view(_MOTION)[0]
        return {
            f'peak_displacement{changed}_m': float(now['peak']),
            f'rms_displacement{changed}_m': math.sqrt(float(now['square']) / float(now['count'])),
            f'peak_mount_force{changed}_n': float(now['force_peak']),
        }

    def _take(self, samples: Samples, part: slice) -> None:
        stamps, traced = samples.stamps[part].copy(), samples.traced[part].copy()
        setpoints = samples.setpoints[part].copy()
        traces = samples.traces[part].copy().view(self._trace)[:, 0]
        traces[~traced] = np.zeros(1, self._trace)[0]
        truth = samples.truths[part].view(TRUTH)[:, 0]
        _add_motion(self._motion, truth['displacement'], truth['mount_force'])
        self.answers.add(ControlAnswers(stamps, setpoints, traced, traces, SampleCounts()))
        if self._other is None:
            self._setpoints.append(setpoints)
        else:
            others = self._other.setpoints[self._count : self._count + len(stamps)]
            self.difference.add(stamps, setpoints, others)
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
