"""Another policy than the paper's, one file and one line: driven, recorded, replayed, asked afterwards."""

import numpy as np
import pytest
import viscous_example

import engine_mount
from engine_mount.drives.drive import drive
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import replay
from engine_mount.recordings.session import recorded_session, session_content, session_parameters
from engine_mount.reports.drive.signals import load_drive, tracking_error
from engine_mount.reports.sections.subject import Subject
from engine_mount.settings.chosen import policy_of, with_recorded_policy
from mount_control.policy.registry import POLICIES
from mount_recorder.session import session_text

SIM = {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 1.0}
CONTINUOUS = {'policy': 'continuous_viscous'}
CHOSEN = {'policy': 'viscous_example', 'viscous_example.damping_coefficient': 800.0}


@pytest.fixture(scope='module', autouse=True)
def example():
    """Register the worked example as a policy."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(POLICIES, 'viscous_example', viscous_example)
        yield


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    """Core drives of the paper's policy and of the example, with the session that a graph writes."""
    found = {}
    for name, control in {
        'switched_viscous': {'policy': 'switched_viscous'},
        'continuous_viscous': CONTINUOUS,
        'viscous_example': CHOSEN,
    }.items():
        folder = tmp_path_factory.mktemp(name) / 'recording'
        parameters = {'mount_sim': SIM, 'mount_control': control}
        record_core(folder, parameters, session_text({'scenario': 'bench', 'parameters': parameters}))
        found[name] = folder
    return found


def test_a_recording_names_the_policy_and_what_it_traced(drives):
    recording = engine_mount.open(drives['viscous_example'])
    trace = recording['control_trace']
    names = ('displacement', 'velocity', 'crank_frequency', 'predicted_velocity', 'damping_active')
    assert trace.names[:5] == names
    np.testing.assert_array_equal(trace['desired_force'], 800.0 * trace['predicted_velocity'])
    assert trace.unit('predicted_velocity') == 'm/s'
    assert 'policy: viscous_example' in recording.latched('session').data


@pytest.mark.parametrize('policy', ['switched_viscous', 'continuous_viscous', 'viscous_example'])
def test_each_is_replayed_to_the_bit(drives, policy):
    outcome = replay(drives[policy])
    assert outcome.agreement.equal, outcome.agreement


@pytest.mark.parametrize(('policy', 'levels'), [('switched_viscous', 2), ('viscous_example', 0)])
def test_a_report_reads_a_drive_of_any_policy(drives, policy, levels):
    recording = engine_mount.open(drives[policy])
    drive, subject = load_drive(recording), Subject(recording)
    assert len(subject.run.levels) == levels
    assert np.isfinite(drive.seen.band_displacement).any() == (policy == 'switched_viscous')
    assert subject.tracking.error < 0.03
    own = policy_of(with_recorded_policy(session_parameters(session_content(recorded_session(recording)))))
    assert subject.tracking.error == tracking_error(drive, *own)


def test_a_session_without_a_policy_is_of_the_first_and_a_drive_names_its_own(tmp_path):
    parameters = {'mount_sim': SIM, 'mount_control': {'policy': 'switched_viscous'}}
    record_core(tmp_path / 'old', parameters, session_text({'parameters': {'mount_sim': SIM}}))
    assert replay(tmp_path / 'old').agreement.equal
    driven = drive(core=True, scenario='bench', parameters={'mount_sim': SIM}, out=tmp_path / 'new')
    assert 'policy: continuous_viscous' in engine_mount.open(driven.recording).latched('session').data
    outcome = replay(driven.recording)
    assert outcome.agreement.equal
    assert 'amplitude' in outcome.replayed.runs[0].traces.dtype.names


def test_a_recording_is_asked_what_another_policy_would_have_answered(drives):
    outcome = replay(drives['switched_viscous'], CHOSEN)
    (run,) = outcome.replayed.runs
    assert 'magnitude' not in run.traces.dtype.names
    moving = run.traces['predicted_velocity'] != 0.0
    assert (run.traces['desired_force'][moving] / run.traces['predicted_velocity'][moving]).round(
        6
    ).tolist() == [800.0] * moving.sum()
    assert not outcome.agreement.equal
