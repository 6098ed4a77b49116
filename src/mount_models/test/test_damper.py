"""Damper characteristics: tables that equal their law, are odd, saturate, and refuse nonsense."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_models.damper import (
    DAMPERS,
    DegressiveDamper,
    ProgressiveDamper,
    ViscousDamper,
    damper_curve,
    damper_force,
    damper_text,
)
from mount_models.quantity import ParameterError

POINTS = {'velocity': [0.0, 0.004, 0.05, 0.2], 'force': [0.0, 0.0, 90.0, 150.0]}


@given(
    damping_coefficient=st.floats(10.0, 8000.0),
    dead_zone=st.one_of(st.just(0.0), st.floats(1e-4, 0.02)),
    velocity=st.floats(-0.4, 0.4),
)
@settings(deadline=None, derandomize=True, max_examples=150)
def test_viscous_curve_equals_its_law_at_and_between_the_nodes(damping_coefficient, dead_zone, velocity):
    curve = damper_curve(ViscousDamper(damping_coefficient, dead_zone, 10000.0))
    law = damping_coefficient * max(abs(velocity) - dead_zone, 0.0) * np.sign(velocity)
    assert damper_force(curve.table, curve.velocity_step, velocity) == pytest.approx(
        law, rel=1e-12, abs=1e-10
    )
    velocities = np.arange(curve.table.size) * curve.velocity_step
    nodes = damping_coefficient * np.maximum(velocities - dead_zone, 0.0)
    np.testing.assert_allclose(curve.table, nodes, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize('name', DAMPERS)
def test_every_named_curve_is_odd_rises_and_rests_in_the_dead_zone(name):
    curve = damper_curve(name)
    velocity = np.linspace(0.0, 1.5, 3001)
    force = curve.force(velocity)
    assert np.array_equal(curve.force(-velocity), -force)
    assert np.all(np.diff(force) >= 0.0)
    assert np.all(force[velocity <= 0.004] == 0.0)
    assert force[velocity > 0.0041].min() > 0.0


def test_curve_saturates_at_the_last_node_below_its_limit():
    curve = damper_curve(ViscousDamper(4000.0, force_limit=150.0))
    assert curve.table[-1] == pytest.approx(150.0, abs=1e-9)
    assert curve.force([0.05, 0.5, 1e9, -1e9]) == pytest.approx([150.0, 150.0, 150.0, -150.0], abs=1e-9)
    uneven = damper_curve(ViscousDamper(4000.0, force_limit=151.0))
    assert 151.0 - 4000.0 * uneven.velocity_step < uneven.force(1.0) <= 151.0


def test_degressive_curve_starts_with_its_slope_and_approaches_its_final_force():
    curve = damper_curve(DegressiveDamper(4000.0, 0.004, 300.0, 120.0))
    assert curve.force(0.0045) == pytest.approx(2.0, rel=0.01)
    assert curve.force(0.9) == pytest.approx(120.0, abs=1e-9)


def test_progressive_curve_doubles_the_viscous_force_at_its_doubling_velocity():
    curve = damper_curve(ProgressiveDamper(1000.0, 0.004, 300.0, 0.040))
    assert curve.force(0.044) == pytest.approx(80.0, rel=1e-9)


@pytest.mark.parametrize('law', [DegressiveDamper(), ProgressiveDamper()])
def test_bent_curves_are_met_between_the_nodes(law):
    velocity = np.linspace(0.004, 0.09, 4001)
    assert damper_curve(law).force(velocity) == pytest.approx(law.magnitude(velocity - 0.004), abs=0.01)


@pytest.mark.parametrize('damping_coefficient', ['1', '2500', '2500.5', '1e3', '1e5'])
def test_any_viscous_damper_within_its_limits_has_a_name(damping_coefficient):
    curve = damper_curve(f'viscous_{damping_coefficient}')
    assert np.array_equal(curve.table, damper_curve(ViscousDamper(float(damping_coefficient))).table)


def test_a_text_says_what_a_mapping_says():
    for mapping in ({'law': 'viscous', 'damping_coefficient': 2500.0, 'dead_zone': 0.002}, POINTS):
        text = damper_text(mapping)
        assert '\n' not in text
        assert np.array_equal(damper_curve(text).table, damper_curve(mapping).table)
    assert damper_text('viscous_2500') == 'viscous_2500'


def test_points_are_joined_by_straight_lines_and_constant_behind_the_last():
    curve = damper_curve(POINTS)
    assert curve.force([0.0, 0.002, 0.004]) == pytest.approx([0.0, 0.0, 0.0])
    assert curve.force([0.027, 0.05, 0.1, 0.2, 3.0]) == pytest.approx([45.0, 90.0, 110.0, 150.0, 150.0])
    assert curve.force(-0.05) == pytest.approx(-90.0)


def test_unknown_velocity_gives_unknown_force():
    curve = damper_curve('viscous_2000')
    assert np.isnan(damper_force(curve.table, curve.velocity_step, np.nan))


@pytest.mark.parametrize(
    ('choice', 'sentence'),
    [
        ('soft', "no damper curve is called 'soft'; known are viscous_1000"),
        (
            'viscous_5x',
            'known are .* viscous_<N s/m>, a law such as .*, or points',
        ),
        (
            '{law: viscous',
            "damper '{law: viscous' is not valid YAML in line 2: .*known .* viscous_1000",
        ),
        ('{law: viscous, law: degressive}', "line 1: the key 'law' stands there twice"),
        ('viscous_0.5', r'damping_coefficient \(0.5 N s/m\) must lie within 1 \.\. 100000'),
        ('{velocity: [0, 1]}', 'must have the columns velocity and force, m/s and N'),
        (
            {'velocity': [0, 1], 'force': 3},
            'force must be a list of finite numbers; instead received 3',
        ),
        ({'velocity': [0, 1, 2], 'force': [0, 1]}, r'\(3 numbers\) and force \(2 numbers\)'),
        (
            {'velocity': [0, np.nan], 'force': [0, 1]},
            'velocity must be a list of finite numbers',
        ),
        (
            {'velocity': [0, 0.1, 0.1], 'force': [0, 1, 2]},
            'must rise strictly within 0 .. 1 m/s',
        ),
        ({'velocity': [0, 2], 'force': [0, 1]}, r'velocity \(0 \.\. 2 m/s\)'),
        ({'velocity': [0, 1], 'force': [5, 9]}, r'force \(5 N at first.* must begin at 0 N'),
        ({'velocity': [0, 0.5, 1], 'force': [0, -1, 9]}, 'friction only opposes motion'),
        ({'velocity': [0, 1], 'force': [0, 0]}, 'be greater than 0 N somewhere'),
        ({'law': 'magic'}, "no damper law is called 'magic'; known are viscous"),
        ({'law': 'viscous', 'slope': 5.0}, "'slope' is no parameter of the viscous damper"),
        (ViscousDamper(-5.0), r'damping_coefficient \(-5 N s/m\) must lie within 1 \.\.'),
        (
            ViscousDamper(2000.0, dead_zone=1e-9),
            r'dead_zone \(1e-09 m/s\) .* must be 0 or at least',
        ),
        (ViscousDamper(90000.0, force_limit=2.0), r'force_limit \(2 N\) of the damper'),
    ],
)
def test_nonsense_is_refused_with_a_sentence(choice, sentence):
    with pytest.raises(ParameterError, match=sentence):
        damper_curve(choice)
