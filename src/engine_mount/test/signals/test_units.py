"""Units by every spelling that a header or a user writes."""

import numpy as np
import pytest

from engine_mount.signals.signal import SignalError
from engine_mount.signals.units import is_unit, unit_of


@pytest.mark.parametrize(
    ('text', 'symbol', 'value', 'in_si'),
    [
        ('[µm]', 'um', 5000.0, 5e-3),
        ('μm', 'um', 1.0, 1e-6),
        ('Inch', 'in', 1.0, 0.0254),
        ('g', 'g', 1.0, 9.80665),
        ('mg', 'mg', 1000.0, 9.80665),
        ('m/s²', 'm/s^2', 1.0, 1.0),
        ('m·s^-2', 'm/s^2', 1.0, 1.0),
        ('m s^-1', 'm/s', 1.0, 1.0),
        ('(G)', 'g', 1.0, 9.80665),
        ('lbf', 'lbf', 1.0, 4.4482216152605),
        ('kip', 'kip', 1.0, 4448.2216152605),
        ('Sec', 's', 1.0, 1.0),
        ('km/h', 'km/h', 36.0, 10.0),
        ('mph', 'mph', 1.0, 0.44704),
        ('°C', 'degC', 20.0, 293.15),
        ('degF', 'degF', 212.0, 373.15),
        ('mH', 'mH', 2.5, 2.5e-3),
        ('psi', 'psi', 1.0, 6894.757293168),
        ('rpm', 'rpm', 60.0, 2.0 * np.pi),
    ],
)
def test_a_spelling_leads_to_si(text, symbol, value, in_si):
    unit = unit_of(text)
    assert unit.symbol == symbol
    assert unit.to_si(np.array([value]))[0] == pytest.approx(in_si, rel=1e-12)


@pytest.mark.parametrize(
    ('text', 'hint'),
    [
        ('mS', 'for milliseconds write ms'),
        ('S', 'for seconds write s'),
        ('KN', 'write kN'),
        ('Mbar', 'is it mbar'),
        ('MIn', 'is it min'),
        ('furlong', 'known are mm, um, m'),
    ],
)
def test_what_is_no_unit_here_is_refused_with_what_it_may_be(text, hint):
    assert not is_unit(text)
    with pytest.raises(SignalError, match=hint):
        unit_of(text)


def test_a_prefix_is_told_from_its_capital():
    assert unit_of('mN').factor == 1e-3
    assert unit_of('MN').factor == 1e6
    assert not is_unit('mPa') or unit_of('mPa').factor == 1e-3
    assert unit_of('MPa').factor == 1e6


@pytest.mark.parametrize(
    ('text', 'dimension', 'factor'),
    [
        ('mh', 'inductance', 1e-3),
        ('h', 'inductance', 1.0),
        ('kn', 'force', 1e3),
        ('a_per_ms', 'current/time', 1e3),
        ('T/s', 'flux density/time', 1.0),
    ],
)
def test_small_letters_will_do_where_the_dimension_is_known(text, dimension, factor):
    assert is_unit(text, dimension)
    assert unit_of(text, dimension).factor == factor


@pytest.mark.parametrize(('text', 'dimension'), [('mn', 'force'), ('mpa', 'pressure'), ('kg', 'force')])
def test_small_letters_are_refused_where_two_units_differ_by_capitals(text, dimension):
    assert not is_unit(text, dimension)
