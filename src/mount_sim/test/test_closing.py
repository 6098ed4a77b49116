"""How the simulated actuator closes: published gap path, equilibria, snap-through and hysteresis."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from mount_models.quantity import ParameterError, with_values
from mount_sim.plant.closing import (
    ClosingMechanics,
    checked_closing,
    closed_state,
    contact_force,
)
from mount_sim.plant.reluctance import ReluctanceActuator, force
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

MAGNET, COIL, MOUNT = ReluctanceActuator(), RippleCoil(), ClosingMechanics()
WIDE = with_values(MOUNT, contact_gap=250e-6)
"""Pads further away than the gap at which the magnet overcomes the spring for good."""

PATH = [
    (0.0, 508.0, 44.7),
    (0.1, 504.2, 43.8),
    (0.2, 492.0, 43.1),
    (0.3, 468.9, 42.5),
    (0.4, 426.3, 42.2),
    (0.45, 385.8, 42.4),
    (0.5, 348.9, 42.1),
    (1.0, 345.3, 30.4),
    (1.5, 340.0, 16.8),
    (2.0, 336.0, 7.1),
    (3.0, 333.8, 4.0),
]


def settled(mechanics, currents, gap):
    """Return gaps and normal forces as the current passes through `currents`."""
    states = []
    for current in currents:
        gap, normal_force = closed_state(mechanics, MAGNET, current, gap)
        states.append((gap, normal_force))
    return np.array(states).T


def contact_current(mechanics):
    """Return the current (A) that just holds the pads in touch."""
    wanted = contact_force(mechanics)
    return brentq(lambda current: force(MAGNET, current, mechanics.contact_gap) - wanted, 0.0, 3.0)


def imbalance(mechanics, current, gap, normal_force):
    spring = mechanics.spring_stiffness * (mechanics.rest_gap - gap)
    return force(MAGNET, current, gap) - spring - normal_force


def test_the_gap_path_and_the_inductance_along_it_meet_the_published_ones():
    gaps, _ = settled(MOUNT, [current for current, _, _ in PATH], MOUNT.rest_gap)
    assert 1e6 * gaps == pytest.approx([gap for _, gap, _ in PATH], abs=0.051)
    found = [
        1e3 * incremental_inductance(COIL, MAGNET, current, gap)
        for gap, (current, *_) in zip(gaps, PATH, strict=True)
    ]
    assert found == pytest.approx([inductance_mh for *_, inductance_mh in PATH], abs=0.051)


@pytest.mark.parametrize(
    ('current', 'expected', 'tolerance'),
    [(0.5, 2.6, 0.051), (1.0, 75.0, 0.051), (1.5, 180.6, 0.051), (2.0, 261.0, 0.51), (3.0, 304.8, 0.051)],
)
def test_the_normal_force_along_the_path_meets_the_published_one(current, expected, tolerance):
    _, normal_force = closed_state(MOUNT, MAGNET, current, MOUNT.contact_gap)
    assert normal_force == pytest.approx(expected, abs=tolerance)


def test_contact_force_and_current_are_the_published_ones():
    assert contact_force(MOUNT) == pytest.approx(22.26, abs=0.0051)
    assert contact_current(MOUNT) == pytest.approx(0.4725, abs=0.000051)


@settings(deadline=None, max_examples=300)
@given(
    current=st.floats(-3.0, 3.0),
    start=st.floats(0.0, 1.0),
    contact_gap=st.floats(150e-6, 500e-6),
    opening=st.floats(10e-6, 500e-6),
    spring_stiffness=st.floats(2e4, 5e6),
    pad_stiffness=st.floats(5e6, 1e9),
)
def test_every_state_is_an_equilibrium_of_its_branch(
    current, start, contact_gap, opening, spring_stiffness, pad_stiffness
):
    mechanics = ClosingMechanics(spring_stiffness, pad_stiffness, contact_gap, contact_gap + opening)
    gap, normal_force = closed_state(mechanics, MAGNET, current, contact_gap + start * opening)
    if normal_force > 0.0:
        assert gap == pytest.approx(contact_gap - normal_force / pad_stiffness, abs=1e-15)
    else:
        assert contact_gap <= gap <= mechanics.rest_gap + 1e-12
    assert abs(imbalance(mechanics, current, gap, normal_force)) < 1e-6


@settings(deadline=None, max_examples=60)
@given(current=st.floats(0.0, 3.0), start=st.floats(-0.05, 1.0), spring_stiffness=st.floats(5e4, 2e6))
@example(current=2.25, start=0.5, spring_stiffness=1321410.0)  # saturated, and just above the contact
def test_the_state_is_the_first_equilibrium_on_the_way(current, start, spring_stiffness):
    """The halves may not jump over an equilibrium: the net force keeps its sign up to the one they reach."""
    mechanics = with_values(WIDE, spring_stiffness=spring_stiffness)
    before = WIDE.contact_gap + start * (WIDE.rest_gap - WIDE.contact_gap)
    after, _ = closed_state(mechanics, MAGNET, current, before)

    def net(gap):
        pads = mechanics.pad_stiffness * max(mechanics.contact_gap - gap, 0.0)
        return imbalance(mechanics, current, gap, pads)

    on_the_way = np.linspace(before, after, 400)[1:-1]
    if abs(after - before) > 1e-8:
        assert all(net(gap) * (before - after) > 0.0 for gap in on_the_way)


def test_wide_pads_snap_shut_at_the_fold_and_open_only_at_the_contact_current():
    up = np.linspace(0.0, 0.6, 6001)
    closing, _ = settled(WIDE, up, WIDE.rest_gap)
    opening, _ = settled(WIDE, up[::-1], closing[-1])
    jump = int(np.argmin(np.diff(closing)))
    snap_current = up[jump + 1]
    release_current = up[::-1][int(np.argmax(np.diff(opening))) + 1]
    assert np.diff(closing)[jump] < -50e-6
    assert release_current == pytest.approx(contact_current(WIDE), abs=2e-4)
    assert snap_current - release_current > 0.01


@pytest.mark.parametrize(('current', 'before'), [(math.nan, 400e-6), (1.0, math.nan), (math.inf, 400e-6)])
def test_unknown_arguments_lead_to_unknown_states(current, before):
    gap, normal_force = closed_state(MOUNT, MAGNET, current, before)
    assert math.isnan(gap)
    assert math.isnan(normal_force)


def test_pads_that_touch_at_rest_are_refused():
    with pytest.raises(
        ParameterError, match=r'contact_gap \(520\.0 um\) must lie below rest_gap \(508\.0 um\)'
    ):
        checked_closing(MOUNT._replace(contact_gap=520e-6), MAGNET)


def test_springs_that_the_magnet_never_overcomes_are_refused():
    stiff = MOUNT._replace(spring_stiffness=9e6)
    with pytest.raises(ParameterError, match=r'contact force \(1431\.0 N\) is beyond'):
        checked_closing(stiff, MAGNET)
