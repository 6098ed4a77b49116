"""A replay for scripts: the recorded answers where nothing is changed, others where something is."""

from pathlib import Path

import pytest

from engine_mount.drives.what_if import what_if
from mount_models.quantity import ParameterError

REFERENCE = Path(__file__).resolve().parents[4] / 'bags' / 'reference' / 'opening'


def test_without_a_change_the_answers_are_those_recorded_and_nothing_is_written():
    outcome = what_if(REFERENCE)
    assert outcome.held
    assert outcome.agreement.equal
    assert outcome.folder is None


def test_a_changed_parameter_changes_the_answers_and_the_recorded_ones_stay_to_compare_with():
    outcome = what_if(str(REFERENCE), {'mount_control.continuous_viscous.damping_coefficient': 3200.0})
    (run,) = outcome.replayed.runs
    assert outcome.agreement.setpoints.differing
    assert run.setpoints.shape == run.stamps.shape == run.traces.shape


def test_a_parameter_that_would_have_no_effect_is_refused():
    with pytest.raises(ParameterError, match='switch_on_level of the policy switched_viscous'):
        what_if(REFERENCE, {'switch_on_level': 0.0006})
