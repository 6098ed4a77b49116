"""A replay as a call: the recorded answers where nothing is changed, others where something is."""

import pytest
from references import REFERENCES_FOLDER

from engine_mount.drives.replay import replay, with_changes
from mount_models.quantity import ParameterError

REFERENCE = REFERENCES_FOLDER / 'opening'


def test_without_a_change_the_answers_are_those_recorded_and_nothing_is_written():
    outcome = replay(REFERENCE)
    assert outcome.held
    assert outcome.agreement.equal
    assert outcome.recording is None


@pytest.mark.parametrize('name', ['mount_control.continuous_viscous.damping_coefficient', 'nested'])
def test_a_changed_parameter_changes_the_answers_and_the_recorded_ones_stay_to_compare_with(name):
    change = {name: 3500.0}
    if name == 'nested':
        change = {'mount_control': {'continuous_viscous.damping_coefficient': 3500.0}}
    outcome = replay(str(REFERENCE), change)
    (run,) = outcome.replayed.runs
    assert outcome.agreement.setpoints.differing
    assert run.setpoints.shape == run.stamps.shape == run.traces.shape
    assert 'damping_coefficient = 3500.0 (recorded' in ' '.join(outcome.sentences())


def test_a_parameter_that_would_have_no_effect_is_refused_with_both_policies_and_the_remedy():
    told = (
        'switch_on_level of the policy switched_viscous would .* the chosen policy is continuous_viscous; '
        'set mount_control.policy to switched_viscous, or leave it'
    )
    with pytest.raises(ParameterError, match=told):
        replay(REFERENCE, {'switch_on_level': 0.0006})


RECORDED = {
    'mount_init': {'peak_current': 2.5},
    'mount_control': {'damper': 'viscous_2000', 'friction.a_p1': 0.4, 'contact.contact_stiffness': 3e6},
}


def test_what_is_changed_holds_and_the_rest_is_as_recorded():
    changed = with_changes(RECORDED, {'mount_control': {'friction.a_p1': 0.5}})
    assert changed == {
        'mount_init': {'peak_current': 2.5},
        'mount_control': {**RECORDED['mount_control'], 'friction.a_p1': 0.5},
    }


def test_another_specimen_takes_the_friction_of_the_one_before_with_it():
    changes = {'mount_control': {'parameters_file': 'left.yaml', 'friction.a_p2': 0.1}}
    assert with_changes(RECORDED, changes)['mount_control'] == {
        'damper': 'viscous_2000',
        'parameters_file': 'left.yaml',
        'friction.a_p2': 0.1,
    }
