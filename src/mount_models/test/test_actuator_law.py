"""The current-force law: Table 1 figures, its inverse, its guards, and where the printed law breaks up."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.actuator import (
    TABLE_1,
    check_force_law,
    checked_current_for_force,
    checked_force,
    current_for_force,
    force,
)
from mount_models.quantity import LawRefusedError, OutsideLawError

UNGUARDED = TABLE_1._replace(gap_low=50e-6, gap_high=900e-6)

CURRENTS = (0.0, 0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
FORCES = {
    200: (0, 11.75, 66.81, 244.74, 308.22, 345.98, 375.52, 397.95),
    349: (0, 4.32, 23.43, 89.29, 195.58, 268.64, 302.97, 330.88),
    492: (0, 2.41, 14.24, 55.59, 122.73, 207.07, 253.71, 279.66),
    700: (0, -8.00, -46.31, -177.96, -387.29, -655.67, -927.04, -1004.47),
}


@pytest.mark.parametrize('gap_um', FORCES)
def test_force_meets_the_table_computed_from_table_1(gap_um):
    law = TABLE_1 if 200 <= gap_um <= 520 else UNGUARDED
    assert checked_force(law, CURRENTS, gap_um * 1e-6) == pytest.approx(FORCES[gap_um], abs=0.0051)


def test_force_is_equation_3_to_the_last_digits():
    gap_um, current = 349.0, 1.3
    a1 = 70.2 - 0.157 * gap_um + 5.84e-4 * gap_um**2 - 9.77e-7 * gap_um**3
    a2 = 77.2 - 0.305 * gap_um + 5.28e-4 * gap_um**2 - 2.58e-7 * gap_um**3
    a3 = 20.7 - 0.11 * gap_um + 2.3e-4 * gap_um**2 - 1.59e-7 * gap_um**3
    a4 = -8.9e-3 + 4.6e-3 * gap_um
    a5 = 354 - 2.21 * gap_um + 5e-3 * gap_um**2 - 3.85e-6 * gap_um**3
    knee, bend = math.atan(a3 * a4), math.atan(a3 * (current - a4))
    expected = (a1 + a2 * current) * (knee + bend) + a5 * current**2 * (knee - bend)
    assert force(TABLE_1, current, 349e-6) == pytest.approx(expected, rel=1e-9)


def test_force_without_current_is_exactly_zero():
    assert (checked_force(UNGUARDED, 0.0, np.linspace(100e-6, 800e-6, 71)) == 0.0).all()


@settings(deadline=None, max_examples=200)
@given(current=st.floats(1e-3, 3.0), gap=st.floats(200e-6, 520e-6))
def test_the_inverse_leads_back_to_the_current(current, gap):
    assert abs(current_for_force(TABLE_1, force(TABLE_1, current, gap), gap) - current) <= 1e-6


def test_the_printed_law_passes_its_own_check_over_its_guarded_range():
    check_force_law(TABLE_1)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'gap_high': 600e-6}, r'the force must .* um and .* A'),
        ({'gap_low': 120e-6}, r'rise with current; at 120 um and 2\.9'),
        ({'gap_low': 130e-6}, 'fall with the air gap'),
        ({'gap_low': 520e-6, 'gap_high': 200e-6}, 'rising order'),
    ],
)
def test_the_check_refuses_the_printed_law_where_it_breaks_up(changes, reason):
    with pytest.raises(LawRefusedError, match=reason):
        check_force_law(TABLE_1._replace(**changes))


def test_a_gap_outside_the_guarded_range_is_refused_in_a_sentence():
    with pytest.raises(
        OutsideLawError, match=r'air gap \(560\.0 um\) must lie within 200\.0 \.\. 520\.0 um; '
    ):
        checked_force(TABLE_1, 1.0, 560e-6)
    with pytest.raises(OutsideLawError, match=r'air gap \(199\.0 um\)'):
        checked_current_for_force(TABLE_1, 10.0, [349e-6, 199e-6])
    with pytest.raises(OutsideLawError, match='nan'):
        checked_force(TABLE_1, 1.0, math.nan)


@pytest.mark.parametrize('current', [-0.01, 3.01, math.nan])
def test_a_current_outside_the_guarded_range_is_refused(current):
    with pytest.raises(OutsideLawError, match=r'must lie within 0\.000 \.\. 3\.000 A'):
        checked_force(TABLE_1, current, 349e-6)


@pytest.mark.parametrize('wanted', [-1.0, 331.0, math.nan, math.inf])
def test_an_unreachable_force_is_refused(wanted):
    with pytest.raises(OutsideLawError, match=r'within 0\.00 \.\. 330\.88 N'):
        checked_current_for_force(TABLE_1, [100.0, wanted], 349e-6)
    assert math.isnan(current_for_force(TABLE_1, wanted, 349e-6))


@pytest.mark.parametrize(('current', 'gap'), [(-0.1, 349e-6), (3.1, 349e-6), (1.0, 199e-6), (1.0, 521e-6)])
def test_compiled_force_is_nan_outside_the_guarded_range(current, gap):
    assert math.isnan(force(TABLE_1, current, gap))
    assert math.isnan(current_for_force(TABLE_1, 100.0, 521e-6))
