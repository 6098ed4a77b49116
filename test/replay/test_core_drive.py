"""Acceptance of the whole chain: initialisation, control and plant as plain function calls.

Plant and controller share the friction law unless a test says otherwise; so the figures say how well the
chain works, not how well the law describes a real mount.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from engine_mount.drives.loop import run as core_run
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import CoreOutcome, run_core
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.series import Series
from engine_mount.reports.drive.signals import DriveSignals, load_drive, tracking_error
from engine_mount.settings.chosen import policy_of
from engine_mount.signals.excitation import build_excitation
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.arithmetic.series import series_of
from mount_models.damper import damper_curve
from mount_ros import topics
from mount_ros.topics import Topic
from mount_sim.plant.mounts import with_control_of_mount
from mount_sim.plant.simulated_car import DivergedError

PAPER = {'policy': 'switched_viscous'}
PERIOD = 0.125  # s, of 8 Hz
BENCH = {
    'scenario': 'bench',
    'timeline.start': 2.8,
    'timeline.duration': 4.0,
    'electronics.ripple_noise': 0.0,
}
SHORT = {**BENCH, 'timeline.duration': 0.2}
UNREACHABLE = {'switch_on_level': 0.009}  # m: damping never goes on


@dataclass(frozen=True)
class Recorded:
    """A core run: its outcome, its recording and the signals of the drive."""

    outcome: CoreOutcome
    settings: dict[str, dict[str, Any]]
    recording: Recording
    drive: DriveSignals

    def __getitem__(self, topic: Topic) -> Series:
        return self.recording[topic.name]

    @property
    def tracking(self) -> float:
        """Rms error of the friction force as a share of the wanted peak."""
        return tracking_error(self.drive, *policy_of(self.settings))


@pytest.fixture(scope='module')
def run(tmp_path_factory) -> Callable[..., Recorded]:
    def run(sim: dict[str, Any], control: dict[str, Any] | None = None) -> Recorded:
        settings = {'mount_sim': sim, 'mount_control': PAPER | (control or {})}
        folder = tmp_path_factory.mktemp('core') / 'recording'
        outcome = record_core(folder, settings, '')
        recording = open_recording(folder)
        return Recorded(outcome, settings, recording, load_drive(recording, outcome.excitation_start))

    return run


def _initialisation(**changes: Any):
    """The result of an initialisation with some of the plant's parameters changed."""
    settings = {'mount_sim': {**SHORT, **{name.replace('__', '.'): v for name, v in changes.items()}}}
    result = run_core(settings, lambda topic, raw, stamp: None).result
    assert result is not None
    return result


@pytest.fixture(scope='module')
def matched(run) -> Recorded:
    """Bench, 8 Hz, 1 mm, viscous_2000; controller and plant have the same friction, no ripple noise."""
    return run(BENCH)


def test_friction_force_is_never_far_from_the_damper_s(matched):
    """In the rms, and in the largest error of a sample over the last 2 s: at most 4 % of the peak."""
    assert matched.tracking <= 0.02
    settled = matched.drive.seen.damping_active & (matched.drive.seen.time > 2.0)
    time, force = matched.drive.seen.time[settled], matched[topics.SIM_TRUTH]['friction_force'][settled]
    # what the plant shows at a sample is the force of the step that has just ended, half a sample ago
    velocity = 1e-3 * 2 * np.pi * 8.0 * np.cos(2 * np.pi * 8.0 * time)
    wanted = damper_curve(DEFAULT_DAMPER).force(velocity)
    assert np.abs(force - wanted).max() <= 0.04 * np.abs(wanted).max()


def test_friction_force_follows_the_damper_after_a_noisy_initialisation(run):
    errors = [run({**BENCH, 'electronics.ripple_noise': 0.01, 'seed': seed}).tracking for seed in (1, 2, 3)]
    assert max(errors) <= 0.03


@pytest.mark.parametrize('scale', [0.85, 1.15])
def test_friction_force_follows_where_the_plant_s_friction_differs(run, scale):
    assert run({**BENCH, 'friction.scale': scale}).tracking <= 0.13


def test_with_damping_off_there_is_no_friction_at_all_after_initialisation(run):
    recorded = run({**BENCH, 'timeline.duration': 1.0}, UNREACHABLE)
    truth, time = recorded[topics.SIM_TRUTH], recorded.drive.truth.time
    during = time < -0.01
    assert truth['normal_force'][during].max() > 200.0  # the ramp of the initialisation closes the actuator
    assert np.abs(truth['displacement']).max() > 0.99e-3
    assert (truth['friction_force'][~during] == 0.0).all()
    assert (truth['coil_current'][~during] == 0.0).all()
    assert (recorded[topics.CONTROL_TRACE]['current'] == 0.0).all()


# The other mounts in the seat, with initialisation and control at work


@pytest.mark.parametrize('mount', ['friction_off', 'hydro'])
def test_without_pads_or_current_the_control_asks_in_vain(run, mount):
    recorded = run({**BENCH, 'mount': mount, 'timeline.duration': 1.5})
    assert recorded.outcome.result is not None
    assert recorded.outcome.result.contact_gap == pytest.approx(349e-6, abs=1e-6)
    shaken = recorded.drive.truth.time > 0.05
    assert recorded[topics.CURRENT_SETPOINT]['coil_current'].max() > 0.9
    assert (recorded[topics.SIM_TRUTH]['friction_force'][shaken] == 0.0).all()


def test_the_mount_that_is_always_on_damps_without_having_been_shaken(run):
    settings = with_control_of_mount({'mount_sim': {**BENCH, 'mount': 'friction_always_on'}})
    assert settings['mount_control'] == {**PAPER, 'switching': 'always'}
    recorded = run(settings['mount_sim'], settings['mount_control'])
    active = recorded[topics.CONTROL_TRACE]['damping_active']
    assert (active[124:] == 1.0).all()
    assert recorded.tracking <= 0.02
    # it damps the very first period, which the switched one lets pass
    first = (recorded.drive.truth.time > 0.06) & (recorded.drive.truth.time < 0.125)
    assert np.abs(recorded[topics.SIM_TRUTH]['friction_force'][first]).max() > 30.0


# Initialisation against the truth, through the whole chain


@pytest.mark.parametrize('celsius', [-10.0, 20.0, 70.0])
@pytest.mark.parametrize('core', [0.0035, 0.0043])
def test_a_warm_or_cold_coil_is_compensated_by_its_measured_temperature(celsius, core):
    """The controller assumes 0.0043 1/K of the core, measured between 20 and 80 degC."""
    result = _initialisation(electronics__coil_temperature=celsius, temperature__core=core)
    assert result.evidence.temperature.celsius == celsius
    wrong = (0.0043 - core) * abs(celsius - 20.0)  # share of conductivity that the controller does not know
    assert result.rest_gap == pytest.approx(508e-6, abs=2e-6 + 350e-6 * wrong)
    assert result.contact_gap == pytest.approx(349e-6, abs=4e-6 + 200e-6 * wrong)


def test_a_mount_beyond_the_range_of_its_sensor_is_told_and_answered_with_0_ampere(run):
    """An engine that shakes at its eigenfrequency; the sensor reaches 50 mm to either side."""
    shaking = {'idle.amplitude': 2000.0, 'idle.frequency': 8.0, 'electronics.displacement_noise': 0.0}
    sim = {**BENCH, 'scenario': 'motorway', 'timeline.duration': 3.0, **shaking}
    recorded = run(sim, {'displacement_range': 0.1, **UNREACHABLE})
    displacement, setpoint = recorded[topics.DISPLACEMENT]['mount'], recorded[topics.CURRENT_SETPOINT]
    invalid = np.isnan(displacement)
    first = recorded[topics.DISPLACEMENT].stamps[invalid][0] / 1e9
    assert 0 < recorded.outcome.beyond_range.samples == invalid.sum() < len(invalid)
    assert recorded.outcome.beyond_range.first == pytest.approx(first)
    assert (setpoint['coil_current'][: len(invalid)][invalid] == 0.0).all()
    beyond = np.abs(recorded[topics.SIM_TRUTH]['displacement']) > 0.05
    np.testing.assert_array_equal(beyond, invalid)


def test_a_plant_that_has_blown_up_ends_the_run_with_the_moment(monkeypatch):
    def poisoned(parameters):
        excitation = build_excitation(parameters)
        values = excitation.values[:]
        values[21_000] = np.nan
        return replace(excitation, values=series_of(values))

    monkeypatch.setattr(core_run, 'build_excitation', poisoned)
    with pytest.raises(DivergedError, match=r'has diverged: at 3\.851 s not all of its state is a finite'):
        run_core({'mount_sim': BENCH}, lambda topic, raw, stamp: None)


def test_a_controller_that_finds_itself_spoiled_is_counted_and_begins_afresh(run, monkeypatch):
    take_many, poisoned = core_run.MountRun.take_many, []

    def take_many_and_poison(self):
        if self.mount.time > 5.0 and not poisoned:
            controller = self.chain.loop.controller
            controller.memory.state.view(controller.compiled.state)['policy']['band']['z1'] = np.nan
            poisoned.append(self.mount.sample)
        return take_many(self)

    monkeypatch.setattr(core_run.MountRun, 'take_many', take_many_and_poison)
    recorded = run(BENCH)
    trace = recorded[topics.CONTROL_TRACE]
    place = recorded[topics.CONTROL_TRACE].stamps.tolist().index(poisoned[0] * 1_000_000)
    assert recorded.outcome.control_faults == 1
    assert trace['damping_active'][place - 1] == trace['damping_active'][-1] == 1.0
    assert trace['damping_active'][place] == trace['current'][place] == 0.0


def test_a_displacement_of_wrong_sign_is_told_by_nothing_and_damps_all_the_same(run):
    """Friction opposes the motion whatever sign it is told; the two directions of its law are exchanged."""
    road = {'timeline.duration': 6.0, 'electronics.ripple_noise': 0.0}
    right, wrong = (run({**road, 'faults': faults}, {}) for faults in ([], ['displacement_inverted@0']))
    assert wrong.outcome.control_faults == 0
    figures = []
    for recorded in (right, wrong):
        truth = recorded[topics.SIM_TRUTH]
        power = truth['friction_force'] * truth['velocity']
        assert -power[power < 0.0].sum() < 1e-2 * power.sum()  # the elastic part alone gives back
        peak = np.abs(truth['displacement']).max()
        figures.append((peak, np.sqrt(np.mean(truth['displacement'] ** 2)), power.sum()))
    assert figures[1] == pytest.approx(figures[0], rel=0.2)
