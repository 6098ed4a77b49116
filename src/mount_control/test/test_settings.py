"""What the controller is set up with is checked before it is made."""

from dataclasses import replace

import pytest

from mount_control import band_pass
from mount_control.settings import check_policies, control_settings, defaults
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import default_specimen

PAPER = {'policy': 'switched_viscous'}


def test_what_is_not_named_is_the_specimen_s():
    specimen = replace(default_specimen(), friction={'a_p1': 0.4, 'a_p2': 0.05})
    settings = control_settings({**PAPER, 'friction.a_p2': 0.06, 'quality': 0.7}, specimen)
    assert settings.friction == FrictionCoefficients(a_p1=0.4, a_p2=0.06)
    assert settings.design.law.band == band_pass.design(8.0, 0.7, 0.0019, 0.001)


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'switch_off_level': 0.0009}, 'must lie below switch_on_level'),
        ({'quality': 50.0}, 'must lie within 0.3 .. 5'),
        ({'damper': 'soft'}, "no damper curve is called 'soft'"),
        ({'friction.a_p1': 100.0}, '.'),
        ({'policy': 'soft'}, "policy 'soft' is unknown; known are switched_viscous"),
        (
            {'policy': 'continuous_viscous', 'continuous_viscous.half_amplitude': 0.0},
            'half_amplitude',
        ),
    ],
)
def test_what_cannot_be_is_refused(values, reason):
    with pytest.raises(ValueError, match=reason):
        control_settings({**PAPER, **values}, default_specimen())


def test_what_no_policy_could_work_with_is_refused_also_of_one_that_is_not_chosen():
    check_policies(defaults())
    assert control_settings({'damper': 'soft'}, default_specimen()).parameters.policy != PAPER['policy']
    with pytest.raises(ValueError, match="no damper curve is called 'soft'"):
        check_policies({**defaults(), 'damper': 'soft'})


def test_more_current_than_was_calibrated_is_refused():
    with pytest.raises(ValueError, match=r'highest_current \(3.000 A\) must not exceed current_limit'):
        control_settings({}, replace(default_specimen(), current_limit=2.5))


def test_what_was_set_stays_even_if_it_is_the_default():
    specimen = replace(default_specimen(), friction={'a_p1': 0.4, 'contact_stiffness': 3e6})
    for value in (0.7, FrictionCoefficients().a_p1):
        values = {'friction.a_p1': value, 'friction.a_p2': 0.1, 'contact.a_p1': 9.0}
        settings = control_settings(values, specimen)
        assert settings.friction == FrictionCoefficients(a_p1=value, a_p2=0.1)
        assert settings.contact == FrictionContact(contact_stiffness=3e6)
