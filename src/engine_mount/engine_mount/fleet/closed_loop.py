"""Engine and mount simulated anew over a recorded acceleration, as recorded and with the change.

A recorded displacement answers the controller that was at work when it was recorded. What another one would
have done to it needs the loop to be closed again: the recorded acceleration of the chassis shakes a simulated
engine on a simulated mount, once with each controller, and these two are compared.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from engine_mount.drives.core import ControlAnswers
from engine_mount.drives.inputs.consumed_samples import ReplayError
from engine_mount.drives.inputs.input import has
from engine_mount.drives.loop.messages import Samples
from engine_mount.drives.loop.run import CoreChain, run_core_into
from engine_mount.fleet.setpoints import (
    AnswerFigures,
    Compared,
    Parameters,
    Recorded,
    changed_parameters,
    compared_answers,
    difference,
    ordered_sum,
)
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import session_parameters
from engine_mount.reports.fleet.looks import Signals
from engine_mount.settings.chosen import control_parameters
from engine_mount.settings.options import with_sample_rate
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE, acceleration_at
from engine_mount.signals.signal import signal_of
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.control_loop import SampleCounts
from mount_control.policy.contract import trace_dtype
from mount_init.initialisation import InitialisationResult
from mount_models.quantity import with_flattened
from mount_ros.topics import SIM_CHASSIS_ACCELERATION
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.plant import TRUTH

_VERTICAL = 'linear_acceleration.z'
_KEPT = ('displacement', 'mount_force', 'chassis_acceleration')  # of the truth
_OWN = ('scenario', 'faults', 'mounts', 'timeline.duration')  # parameters of the drive that was recorded


def compare_motion(recorded: Recorded, changes: Parameters) -> Compared:
    """Return two drives over the recorded acceleration, compared.

    The one is controlled as recorded, the other with `changes`; both begin with the rest in which the mount
    is initialised. Engine, mount and electronics are those of the session, or the defaults. Raises a
    `ValueError` with the reason where there are none.
    """
    after = _with_plant(recorded, changed_parameters(recorded, changes))
    before = _with_plant(recorded, recorded.parameters)
    sim = with_flattened(SimParameters(), before['mount_sim'])
    excitation = _recorded_excitation(recorded.recording, sim.timeline.start)
    drives = _Drive(before, excitation), _Drive(after, excitation)
    zero = drives[0].start
    stamps = drives[0].column('stamp')
    time = (stamps - zero) / 1e9
    first, other = (drive.column('displacement') for drive in drives)
    row = {
        'activations': 1,
        **compared_answers(time, zero, drives, 1.0 / sim.sample_rate),
        **drives[0].motion(),
        **drives[1].motion('_changed'),
        **difference('displacement_difference', 'm', time, other, first),
    }
    setpoints = drives[0].setpoints, drives[1].setpoints
    acceleration = drives[0].column('chassis_acceleration')
    return Compared(row, Signals((stamps - zero) * 1e-9, acceleration, setpoints, (first, other)))


def _with_plant(recorded: Recorded, parameters: Parameters) -> dict[str, Mapping[str, Any]]:
    """Return the parameters with those of the plant in which the recorded mount was simulated, if it was."""
    known = defaults_of_nodes()['mount_sim']
    values = session_parameters(recorded.session).get('mount_sim', {})
    plant = {name: value for name, value in values.items() if name in known and name not in _OWN}
    settings = {**parameters, **checked_settings({'mount_sim': plant})}
    return with_sample_rate(settings, control_parameters(parameters).sample_rate)


def _recorded_excitation(recording: Recording, start: float) -> Excitation:
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
    values = acceleration_at(evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE), STEP_TIME)
    return Excitation(Seat.ACCELERATED_CHASSIS, values, STEP_TIME, start)


class _Drive(AnswerFigures):
    """A simulated drive: what the controller answered, and columns of its samples from `start` (ns) on."""

    def __init__(self, parameters: Parameters, excitation: Excitation):
        super().__init__()
        self.start = round(excitation.start * 1e9)
        self._trace = trace_dtype(CoreChain(parameters).control.policy)
        self._is_initialised = False
        run_core_into(self, parameters, excitation=excitation)

    def motion(self, changed: str = '') -> dict[str, Any]:
        """Return the figures of the motion as columns, with `changed` before their unit."""
        displacement, force = self.column('displacement'), self.column('mount_force')
        square = ordered_sum(displacement * displacement)
        return {
            f'peak_displacement{changed}_m': np.abs(displacement).max(),
            f'rms_displacement{changed}_m': math.sqrt(square / displacement.size),
            f'peak_mount_force{changed}_n': np.abs(force).max(),
        }

    def write_samples(self, samples: Samples) -> None:
        """Take the samples and empty the block."""
        part = slice(int(np.searchsorted(samples.stamps[: samples.count], self.start)), samples.count)
        samples.count = 0
        if part.start == part.stop or not self._is_initialised:
            return
        stamps, setpoints = samples.stamps[part].copy(), samples.setpoints[part].copy()
        traced = samples.traced[part].copy()
        traces = samples.traces[part].copy().view(self._trace)[:, 0]
        traces[~traced] = np.zeros(1, self._trace)[0]
        self.add(ControlAnswers(stamps, setpoints, traced, traces, SampleCounts()))
        self.columns['stamp'].append(stamps)
        truth = samples.truths[part].view(TRUTH)[:, 0]
        for name in _KEPT:
            self.columns[name].append(truth[name].copy())

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        """Take the table with which the controller begins."""
        self.begin_run(*result.table)
        self._is_initialised = True

    def write_off(self, stamp: int) -> None:
        """Let the last setpoint pass."""
