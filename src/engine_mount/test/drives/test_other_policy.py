"""A parameter of another policy than the chosen one is refused."""

import pytest

from engine_mount.drives.other_policy import check_effect
from mount_models.quantity import ParameterError


def test_a_parameter_of_another_policy_is_told_with_both_names_and_the_remedy():
    check_effect({'policy': 'switched_viscous', 'damper': 'degressive', 'highest_current': 2.0})
    check_effect({'damper': 'degressive'}, 'switched_viscous')
    check_effect({'continuous_viscous.quality': 0.7, 'longest_bridge': 0.01})
    check_effect({'policy': 'switched_viscous', 'quality': 0.7}, 'continuous_viscous')
    with pytest.raises(ParameterError, match='damper, quality of the policy switched_viscous would'):
        check_effect({'quality': 0.7, 'damper': 'degressive'})
    told = (
        'the chosen policy is switched_viscous; set mount_control.policy to continuous_viscous, or leave it'
    )
    with pytest.raises(ParameterError, match=told):
        check_effect({'continuous_viscous.quality': 0.7}, 'switched_viscous')
