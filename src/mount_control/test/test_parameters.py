"""Parameters of the controller are refused one by one and against each other."""

import pytest

from mount_control.policy import switched_viscous
from mount_control.settings import ControlParameters, policy_parameters
from mount_models.quantity import ParameterError, quantities
from mount_models.sampling import SAMPLE_TIME

NOTES = {**quantities(ControlParameters()), **quantities(switched_viscous.Parameters())}


def _refusal(**changes):
    with pytest.raises(ParameterError) as caught:
        _checked(**changes)
    return str(caught.value)


def _checked(**changes):
    """The parameters of the paper's policy with some changed, as a controller takes them."""
    policy, parameters = policy_parameters({'policy': 'switched_viscous', **changes})
    policy.design(parameters, SAMPLE_TIME)
    return parameters


def _numbers():
    """The default of each parameter that is a number, by name."""
    defaults = {**ControlParameters()._asdict(), **switched_viscous.Parameters()._asdict()}
    return {name: default for name, default in defaults.items() if not isinstance(default, str | bool)}


@pytest.mark.parametrize('name', _numbers())
def test_each_parameter_is_refused_beyond_both_ends_of_its_range(name):
    note = NOTES[name]
    width = note.high - note.low
    for value in (note.low - 0.01 * width, note.high + 0.01 * width, float('nan')):
        assert f'{name} ({value:g} {note.unit}) must lie within' in _refusal(**{name: value})


def test_the_off_level_must_lie_below_the_on_level():
    expected = (
        'switch_off_level (0.8 mm) must lie below switch_on_level (0.8 mm), '
        'else damping switches on and off at every period'
    )
    assert _refusal(switch_off_level=0.0008) == expected
    assert _checked(switch_off_level=0.00079)


def test_the_lead_must_stay_below_an_eighth_of_a_period():
    expected = (
        'lead_time (13 ms) must stay below an eighth of a period (12.5 ms at 10 Hz); '
        'a longer delay cannot be predicted'
    )
    assert _refusal(lead_time=0.013, eigenfrequency=10.0) == expected
    assert _checked(lead_time=0.0124, eigenfrequency=10.0)
