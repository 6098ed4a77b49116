"""The controller's estimates: contact gap, offset current and force table against the simulated truth."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.actuator import (
    ForceTableError,
    checked_force,
    contact_force,
    current_force_table,
    force,
    offset_current,
)
from mount_models.arithmetic.sums import interpolated
from mount_models.quantity import OutsideLawError
from mount_models.specimen import default_specimen

KNOWN = default_specimen()
LAW, SPRING, PADS = KNOWN.force_law, KNOWN.spring_stiffness, KNOWN.pad_stiffness
REST, CONTACT = 508e-6, 349e-6
TABLE = current_force_table(LAW, SPRING, PADS, REST, CONTACT)


@pytest.mark.parametrize(
    ('light_pressure', 'current'), [(1, 0.483), (2, 0.4935), (3, 0.504), (5, 0.523), (10, 0.570)]
)
def test_the_offset_current_is_the_published_one_within_the_error_of_the_law(light_pressure, current):
    found = offset_current(LAW, SPRING, REST, CONTACT, light_pressure)
    assert found == pytest.approx(current, abs=0.0015)
    assert force(LAW, found, CONTACT) == pytest.approx(22.26 + light_pressure, abs=1e-6)


@pytest.mark.parametrize('worn', [285e-6, 272e-6])
def test_the_offset_current_closes_worn_pads_that_pull_in_before_they_touch(worn):
    way = np.linspace(worn, REST, 1000)
    found = offset_current(LAW, SPRING, REST, worn, 0.5)
    assert (checked_force(LAW, found, way) > SPRING * (REST - way)).all()
    assert force(LAW, found, worn) > contact_force(SPRING, REST, worn) + 0.5


def test_the_table_starts_at_the_contact_current_and_ends_at_full_current():
    assert TABLE[1, 0] == 0.0
    assert force(LAW, TABLE[0, 0], CONTACT) == pytest.approx(contact_force(SPRING, REST, CONTACT), abs=1e-6)
    assert TABLE[0, 0] == pytest.approx(0.4725, abs=0.0015)
    assert TABLE[0, -1] == 3.0
    assert TABLE[1, -1] == pytest.approx(305, abs=3)


def test_the_table_rises_strictly_in_steps_of_half_a_newton():
    assert (np.diff(TABLE) > 0.0).all()
    assert np.diff(TABLE[1])[:-1] == pytest.approx(0.5)
    assert np.diff(TABLE[1])[-1] <= 0.51


def test_each_entry_balances_magnet_spring_and_pads():
    for current, normal_force in TABLE.T[::20]:
        gap = CONTACT - normal_force / PADS
        assert force(LAW, current, gap) == pytest.approx(normal_force + SPRING * (REST - gap), abs=1e-6)


@settings(deadline=None)
@given(normal_force=st.floats(0.5, 303.0))
def test_between_entries_the_table_holds_the_law_within_half_a_per_cent(normal_force):
    current = interpolated(normal_force, TABLE[1], TABLE[0])
    gap = CONTACT - normal_force / PADS
    net = force(LAW, current, gap) - SPRING * (REST - gap)
    assert net == pytest.approx(normal_force, rel=0.005)


@settings(deadline=None, max_examples=40)
@given(contact=st.floats(300e-6, 440e-6), opening=st.floats(20e-6, 200e-6))
def test_a_table_can_be_built_for_every_gap_of_new_and_worn_pads(contact, opening):
    table = current_force_table(LAW, SPRING, PADS, contact + opening, contact)
    assert (np.diff(table) > 0.0).all()
    assert table[0, -1] == 3.0


def test_a_contact_gap_beyond_the_law_is_refused():
    with pytest.raises(OutsideLawError, match=r'air gap \(260\.0 um\)'):
        current_force_table(LAW, SPRING, PADS, REST, 260e-6)
    with pytest.raises(OutsideLawError, match='air gap'):  # of the pads compressed at full current
        current_force_table(LAW, SPRING, PADS, REST, 275e-6)
    with pytest.raises(OutsideLawError, match='coil current'):
        current_force_table(LAW, SPRING, PADS, REST, CONTACT, current_high=3.5)


def test_a_contact_gap_above_the_rest_gap_is_refused():
    with pytest.raises(
        ForceTableError, match=r'contact gap \(400\.0 um\) must lie below the rest gap \(390\.0 um\)'
    ):
        current_force_table(LAW, SPRING, PADS, 390e-6, 400e-6)
    with pytest.raises(ForceTableError):
        contact_force(SPRING, math.nan, 349e-6)


def test_a_spring_that_the_current_cannot_overcome_is_refused():
    with pytest.raises(ForceTableError, match=r'current_high \(0\.40 A\) must close the pads'):
        current_force_table(LAW, SPRING, PADS, REST, CONTACT, current_high=0.4)
    with pytest.raises(OutsideLawError):
        offset_current(LAW, 50.0 * SPRING, REST, CONTACT, 2.0)
