"""Which coefficients of friction and contacts fit together."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact, check_friction
from mount_models.friction.simplified import simplified_response
from mount_models.quantity import LawRefusedError, quantities, with_values

SPOILING = {'b_offset': 30.0, 'b_1': 100.0, 'b_2': 10.0, 'beta_1': 5.0, 'beta_2': 0.1}


@pytest.mark.parametrize(
    'changes', [{}, {'scale': 0.05}, {'scale': 5.0}, {'b_offset': -14.0}, {'b_offset': 30.0}]
)
def test_the_pads_of_the_paper_and_their_variations_are_believed(changes):
    check_friction(with_values(FrictionCoefficients(), **changes), FrictionContact())


@pytest.mark.parametrize(
    ('changes', 'contact', 'reason'),
    [
        (SPOILING, {}, r'slope b of the friction \(.*\) must stay below tangential_stiffness \(1e\+07 N/m\)'),
        ({'b_offset': 30.0, 'b_1': 100.0}, {}, 'its deflection grows without end; set b_offset'),
        ({}, {'tangential_stiffness': 1e4}, r'must stay below tangential_stiffness \(10000 N/m\)'),
        ({'a_p1': -5.0}, {}, r'coefficient of friction \(-.* at \+2.5 mm/s .*\) must be greater than 0'),
        ({'a_n1': -5.0}, {}, r'coefficient of friction \(-.* at -2.5 mm/s .*\) must be greater than 0'),
        ({'alpha_p2': 0.1, 'a_p2': 5.0}, {}, 'not exceed 20; set the parameters a_'),
        ({'lowest_normal_force': 130.0}, {}, r'lowest_normal_force \(130 N\) must not exceed'),
    ],
)
def test_what_each_alone_may_have_does_not_fit_together(changes, contact, reason):
    coefs = with_values(FrictionCoefficients(), **changes)
    with pytest.raises(LawRefusedError, match=reason):
        check_friction(coefs, with_values(FrictionContact(), **contact))


def _within(kind):
    """Sets of parameters anywhere within their ranges."""
    return st.fixed_dictionaries(
        {name: st.floats(note.low, note.high) for name, note in quantities(kind).items()}
    ).map(lambda values: kind(**values))


def _near(kind):
    """Sets of which some parameters are anywhere within their ranges and the others at their defaults."""
    notes = quantities(kind)
    one = st.sampled_from(sorted(notes)).flatmap(
        lambda name: st.tuples(st.just(name), st.floats(notes[name].low, notes[name].high))
    )
    return st.lists(one, max_size=4).map(lambda values: kind()._replace(**dict(values)))


@settings(deadline=None, max_examples=60)
@given(_near(FrictionCoefficients) | _within(FrictionCoefficients), _near(FrictionContact))
@example(FrictionCoefficients(b_offset=30.0), FrictionContact())
@example(FrictionCoefficients(scale=5.0), FrictionContact())
def test_what_passes_stays_finite_in_the_simplified_law(coefs, contact):
    try:
        check_friction(coefs, contact)
    except LawRefusedError:
        assume(False)
    time = 1e-3 * np.arange(20_000)
    displacement = 1e-3 * np.sin(2.0 * np.pi * 8.0 * time)
    load = 150.0 + 150.0 * np.sin(2.0 * np.pi * 0.3 * time)
    velocity = np.gradient(displacement, time)
    simplified, _ = simplified_response(contact, coefs, velocity, load, 1e-3)
    assert np.isfinite(simplified).all()
    assert np.abs(simplified).max() < 1e5
