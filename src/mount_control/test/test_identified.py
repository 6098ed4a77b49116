"""The friction of a specimen file in the controller's parameters."""

from dataclasses import replace

import pytest

from mount_control.identified import check_fits, identified
from mount_control.parameters import ControlParameters
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import SpecimenError, default_specimen

SPECIMEN = replace(default_specimen(), friction={'a_p1': 0.4, 'contact_stiffness': 3e6})


def test_what_was_identified_replaces_defaults():
    assert identified(SPECIMEN, FrictionCoefficients(), {}, 'friction') == FrictionCoefficients(a_p1=0.4)
    assert identified(SPECIMEN, FrictionContact(), {}, 'contact') == FrictionContact(contact_stiffness=3e6)


def test_what_was_set_stays_even_if_it_is_the_default():
    for value in (0.7, FrictionCoefficients().a_p1):
        settings = {'friction.a_p1': value, 'friction.a_p2': 0.1, 'contact.a_p1': 9.0}
        found = identified(SPECIMEN, FrictionCoefficients(), settings, 'friction')
        assert found == FrictionCoefficients(a_p1=value, a_p2=0.1)


def test_a_current_beyond_the_calibration_is_refused():
    weak = replace(SPECIMEN, current_limit=2.5)
    with pytest.raises(SpecimenError, match=r'highest_current \(3\.000 A\) .* current_limit \(2\.500 A\)'):
        check_fits(ControlParameters(), weak)
    check_fits(ControlParameters(highest_current=2.5), weak)
