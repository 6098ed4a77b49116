"""Another policy than the paper's, one file and one line: driven, recorded, replayed, asked afterwards."""

import sys
from pathlib import Path

import numpy as np
import pytest

import mount_bags
from mount_bags.run.session import session_text
from mount_control.policy.registry import POLICIES
from mount_replay.loop.recording import record_core
from mount_replay.replay import CORE, LOCKSTEP, ReplayOrder, parsed_changes, replay_without_output

EXAMPLES = Path(__file__).resolve().parents[2] / 'src' / 'mount_control' / 'test'
SIM = {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 1.0}
CHOSEN = {'policy': 'viscous_example', 'viscous_example.damping_coefficient': 800.0}


@pytest.fixture(scope='module', autouse=True)
def example():
    """Register the worked example as a policy."""
    patch = pytest.MonkeyPatch()
    patch.syspath_prepend(EXAMPLES)
    import viscous_example

    patch.setitem(POLICIES, 'viscous_example', viscous_example)
    yield
    patch.undo()
    sys.modules.pop('viscous_example')


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    """Core drives of the paper's policy and of the example, with the session that a graph writes."""
    found = {}
    for name, control in {
        'switched_viscous': {'policy': 'switched_viscous'},
        'continuous_viscous': {'policy': 'continuous_viscous'},
        'viscous_example': CHOSEN,
    }.items():
        folder = tmp_path_factory.mktemp(name) / 'recording'
        parameters = {'mount_sim': SIM, 'mount_control': control}
        record_core(folder, parameters, session_text({'scenario': 'bench', 'parameters': parameters}))
        found[name] = folder
    return found


def test_a_recording_names_the_policy_and_what_it_traced(drives):
    recording = mount_bags.open(drives['viscous_example'])
    trace = recording['control_trace']
    assert trace.names[:4] == ('displacement', 'velocity', 'predicted_velocity', 'damping_active')
    np.testing.assert_array_equal(trace['desired_force'], 800.0 * trace['predicted_velocity'])
    assert trace.unit('predicted_velocity') == 'm/s'
    assert 'policy: viscous_example' in recording.latched('session').data


@pytest.mark.parametrize('mode', [CORE, LOCKSTEP])
@pytest.mark.parametrize('policy', ['switched_viscous', 'continuous_viscous', 'viscous_example'])
def test_each_is_replayed_to_the_bit(drives, policy, mode):
    outcome = replay_without_output(ReplayOrder(drives[policy], mode))
    assert outcome.agreement.equal, outcome.agreement


def test_a_recording_is_asked_what_another_policy_would_have_answered(drives):
    changes = parsed_changes(CHOSEN)
    outcome = replay_without_output(ReplayOrder(drives['switched_viscous'], CORE, changes=changes))
    (run,) = outcome.replayed.runs
    assert 'magnitude' not in run.traces.dtype.names
    moving = run.traces['predicted_velocity'] != 0.0
    assert (run.traces['desired_force'][moving] / run.traces['predicted_velocity'][moving]).round(
        6
    ).tolist() == [800.0] * moving.sum()
    assert not outcome.agreement.equal
