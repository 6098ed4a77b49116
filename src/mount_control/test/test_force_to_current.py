"""Normal force to coil current through the table of an activation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_control.force_maker import (
    FORCE_STEP,
    ForceTableError,
    current_for,
    highest_force,
    resample,
)


@pytest.fixture(scope='module')
def table(table_rows):
    return resample(*table_rows, 3.0)


def test_nodes_of_the_table_are_met(table, table_rows):
    currents, forces, _ = table_rows
    for current, force in zip(currents[3:6], forces[3:6], strict=True):  # 75, 180.6, 261 N
        assert current_for(table.currents, table.limits, force) == pytest.approx(current, abs=1e-3)
    assert current_for(table.currents, table.limits, 75.0) == pytest.approx(1.0, abs=1e-12)


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_current_is_monotone_and_within_its_limits(table, one, other):
    low, high = sorted((one, other))
    first, second = (current_for(table.currents, table.limits, force) for force in (low, high))
    assert 0.4935 <= first <= second <= 3.0


def test_beyond_the_table_its_last_current_holds(table):
    last = table.currents[-1]
    assert last <= 3.0
    assert current_for(table.currents, table.limits, 1e9) == last
    assert highest_force(table.currents) == pytest.approx(304.8, abs=FORCE_STEP)


def test_a_table_that_does_not_start_at_the_touch_is_refused(table_rows):
    currents, forces, offset = table_rows
    with pytest.raises(ForceTableError, match=r'starts at 2\.60 N \(limit 1 N\).*activate mount_init again'):
        resample(currents[1:], forces[1:], offset, 3.0)
    with pytest.raises(ForceTableError, match='starts at -3'):
        resample(currents, forces - 3.0, offset, 3.0)
    with pytest.raises(ForceTableError, match='starts at nan'):
        resample(currents, np.r_[np.nan, forces[1:]], offset, 3.0)


@pytest.mark.parametrize('offset', [0.0, -0.1, 3.0, 3.5, float('nan')])
def test_an_offset_current_outside_its_limits_is_refused(table_rows, offset):
    currents, forces, _ = table_rows
    with pytest.raises(ForceTableError, match=r'offset_current .* must lie within 0 \.\. 3 A'):
        resample(currents, forces, offset, 3.0)


def test_a_force_that_is_not_a_number_gives_0_ampere(table):
    assert current_for(table.currents, table.limits, float('nan')) == 0.0


@pytest.mark.parametrize('highest', [1e9, float('inf')])
def test_a_table_beyond_any_magnet_is_refused_before_its_places_are_made(table_rows, highest):
    currents, forces, offset = table_rows
    with pytest.raises(ForceTableError, match=r'ends at (1e\+09|inf) N \(limit 10000 N\).*mount_init again'):
        resample(currents, np.r_[forces[:-1], highest], offset, 3.0)


def test_a_table_that_does_not_rise_is_refused(table_rows):
    currents, forces, offset = table_rows
    for row in (currents[::-1], np.r_[currents[:-1], np.nan]):
        with pytest.raises(ForceTableError, match='must rise strictly'):
            resample(row, forces, offset, 3.0)
    with pytest.raises(ForceTableError, match='must rise strictly'):
        resample(currents, np.r_[forces[:3], np.nan, forces[4:]], offset, 3.0)
