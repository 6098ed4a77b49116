"""A replay as a call: the recorded answers where nothing is changed, others where something is."""

from pathlib import Path

import pytest

from engine_mount.drives.replay import replay
from mount_models.quantity import ParameterError

REFERENCE = Path(__file__).resolve().parents[4] / 'bags' / 'reference' / 'opening'


def test_without_a_change_the_answers_are_those_recorded_and_nothing_is_written():
    outcome = replay(REFERENCE)
    assert outcome.held
    assert outcome.agreement.equal
    assert outcome.recording is None


@pytest.mark.parametrize('name', ['mount_control.continuous_viscous.damping_coefficient', 'nested'])
def test_a_changed_parameter_changes_the_answers_and_the_recorded_ones_stay_to_compare_with(name):
    change = {name: 3200.0}
    if name == 'nested':
        change = {'mount_control': {'continuous_viscous.damping_coefficient': 3200.0}}
    outcome = replay(str(REFERENCE), change)
    (run,) = outcome.replayed.runs
    assert outcome.agreement.setpoints.differing
    assert run.setpoints.shape == run.stamps.shape == run.traces.shape
    assert 'damping_coefficient = 3200.0 (recorded' in ' '.join(outcome.sentences())


def test_a_parameter_that_would_have_no_effect_is_refused_with_both_policies_and_the_remedy():
    told = (
        'switch_on_level of the policy switched_viscous would .* the chosen policy is continuous_viscous; '
        'set mount_control.policy to switched_viscous, or leave it'
    )
    with pytest.raises(ParameterError, match=told):
        replay(REFERENCE, {'switch_on_level': 0.0006})
