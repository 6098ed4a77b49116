"""Normal force to coil current through the table of an activation."""

import re

import numpy as np
import pytest
from controllers import TABLE_ROWS
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
def table():
    return resample(*TABLE_ROWS, 3.0)


def test_nodes_of_the_table_are_met(table):
    currents, forces, _ = TABLE_ROWS
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


@pytest.mark.parametrize('offset', [0.0, -0.1, 3.0, 3.5, float('nan')])
def test_an_offset_current_outside_its_limits_is_refused(offset):
    currents, forces, _ = TABLE_ROWS
    with pytest.raises(ForceTableError, match=r'offset_current .* must lie within 0 \.\. 3 A'):
        resample(currents, forces, offset, 3.0)


def test_a_force_that_is_not_a_number_gives_0_ampere(table):
    assert current_for(table.currents, table.limits, float('nan')) == 0.0


TOUCH = r'(limits: first touch of the pads within 0 .. 1 N, end up to 10000 N); activate mount_init again'


@pytest.mark.parametrize(
    ('row', 'places', 'value', 'sentence'),
    [
        (1, 0, 2.6, f'reaches from 2.60 to 304.8 N {TOUCH}'),
        (1, 0, -3.0, 'reaches from -3.00'),
        (1, 0, np.nan, 'reaches from nan'),
        (1, -1, 1e9, 'to 1e+09 N'),
        (1, -1, np.inf, 'to inf N'),  # before the places of the table are made
        (1, 3, np.nan, 'must rise strictly'),
        (0, -1, np.nan, 'must rise strictly'),
        (0, 3, 0.5, 'must rise strictly'),
    ],
)
def test_a_table_that_cannot_be_is_refused(row, places, value, sentence):
    rows = [row.copy() for row in TABLE_ROWS[:2]]
    rows[row][places] = value
    with pytest.raises(ForceTableError, match=re.escape(sentence)):
        resample(*rows, TABLE_ROWS[2], 3.0)
