"""Friction identification: steps 1 to 3, the ladder's laws, and what is refused."""

import numpy as np
import pytest

from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.friction.coefficients import fit_coefficients
from engine_mount.identification.friction.ladder import best_rung, fit_ladder, law_error
from engine_mount.identification.friction.laws import (
    coulomb_force,
    dahl_force,
    elastic_play_force,
    simple_laws,
)
from engine_mount.identification.friction.ramp_hold import (
    RampResponse,
    contact_of_response,
    fit_ramp_hold,
    fit_relaxation,
    printed_formulas,
)
from engine_mount.identification.friction.recording import checked_recording
from engine_mount.identification.friction.sawtooth import RAMP, SAWTOOTH, kind_of_motion, stroke_lines
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient, slope_coefficient
from mount_models.friction.contact import FrictionContact
from mount_sim.plant.friction import full_response

CONTACT = FrictionContact()
TIME = np.arange(0.0, 5.0, 1e-3)


def ramp(contact=CONTACT, p=2e6, noise=0.0, seed=0, start=0.3, time=TIME):
    random = np.random.default_rng(seed)
    c_r, d_r, c_re = contact
    joint, lag = c_re * c_r / (c_re + c_r), d_r / (c_r + p * c_re / (p + c_re))
    kappa = d_r / (c_re + c_r) / lag
    channels = RampResponse(20e-6 * p / (p + joint), kappa, lag, p, 20e-6, start, 0.2).at(time)
    x, force, desired = (
        each + noise * np.sqrt(np.mean(each**2)) * random.standard_normal(each.size) for each in channels
    )
    return checked_recording('ramp', time, x, force, 100.0, desired)


def sawtooth(load, seed=0):
    corners, times = [0.0, 2.5e-3], [0.0, 2.5e-3 / 0.002]
    for speed in (0.002, 0.004, 0.006, 0.010):
        for corner in (-2.5e-3, 2.5e-3):
            corners.append(corner)
            times.append(times[-1] + 5e-3 / speed)
    time = np.arange(0.0, times[-1], 1e-3)
    x = np.interp(time, times, corners)
    force, _, _ = full_response(CONTACT, FrictionCoefficients(), x, np.full(x.size, load), 1e-3)
    random = np.random.default_rng(seed)
    force = force + 0.01 * np.sqrt(np.mean(force**2)) * random.standard_normal(force.size)
    return checked_recording(f'saw {load:g}', time, x, force, load)


def test_step_1_recovers_the_contact_exactly_from_a_ramp_without_noise():
    fit = fit_ramp_hold(ramp(start=0.0))
    assert fit.contact == pytest.approx(CONTACT, rel=0.005)
    assert fit.response.time_constant == pytest.approx(0.44118, abs=1e-5)
    assert fit.response.kappa == pytest.approx(1 - 0.19048, abs=1e-5)


def test_eq_11_put_right_gives_the_published_example_and_as_printed_its_wrong_answers():
    (c_r, _, c_re), p, lag = CONTACT, 2.0e6, 0.4411764706
    joint = c_re * c_r / (c_re + c_r)
    assert contact_of_response(joint, p, 1.0 - 0.19047619, lag) == pytest.approx(CONTACT, rel=1e-6)
    with_p = joint * p / (joint + p)
    k = (1.0 / (1.0 / c_re + 1.0 / p)) / with_p
    assert printed_formulas(with_p, p, k, lag) == pytest.approx((1.67e6, 1.67e6 * lag, c_re), rel=3e-3)


def test_the_amplitude_behind_a_ramp_is_taken_back_to_that_of_a_step():
    found = fit_relaxation(TIME, 1e-6 * (1.0 - 0.24099 * np.exp(-TIME / 0.44118)), 1.0)
    assert found.amplitude == pytest.approx(0.24099e-6, rel=1e-5)
    assert found.at(TIME)[0] == pytest.approx(0.75901e-6, rel=1e-5)
    assert found.kappa(0.0) == pytest.approx(1.0 - 0.24099, rel=1e-5)
    assert found.kappa(0.2) == pytest.approx(1.0 - 0.19048, abs=1e-5)


@pytest.mark.parametrize('seed', [1, 2])
def test_step_1_recovers_drawn_contacts_within_3_percent_with_noise(seed):
    random = np.random.default_rng(seed)
    stiff = 1e7 * random.uniform(0.7, 1.4)
    contact = FrictionContact(stiff, stiff * random.uniform(0.35, 0.7), 4e6 * random.uniform(0.7, 1.4))
    fit = fit_ramp_hold(ramp(contact, 2e6 * random.uniform(0.7, 1.4), 0.01, seed))
    assert fit.contact == pytest.approx(contact, rel=0.03)


def held(time_constants, noise):
    return ramp(noise=noise, time=np.arange(0.0, 0.5 + time_constants * 0.44118, 1e-3))


@pytest.mark.parametrize('noise', [0.0, 0.01])
def test_step_1_refuses_a_ramp_that_is_held_for_less_than_three_time_constants(noise):
    assert fit_ramp_hold(held(3.4, noise)).contact == pytest.approx(CONTACT, rel=0.05)
    for short in (0.5, 2.6):
        with pytest.raises(
            IdentificationError, match=r'held for .* time constants of .* \(at least 3\).* hold for'
        ):
            fit_ramp_hold(held(short, noise))


def test_step_1_refuses_a_contact_that_slides():
    with pytest.raises(IdentificationError, match=r'step 1|misses'):
        fit_ramp_hold(sawtooth(100.0))


def test_steps_2_and_3_recover_a_and_b():
    truth = FrictionCoefficients()
    lines = [
        line
        for seed, load in enumerate((40.0, 80.0, 120.0))
        for line in stroke_lines(sawtooth(load, seed=seed), CONTACT)
    ]
    found = fit_coefficients(lines).coefficients
    points = [
        (s * v, load) for s in (1, -1) for v in (0.002, 0.004, 0.007, 0.01) for load in (40.0, 60.0, 120.0)
    ]
    a = [offset_coefficient(found, *point) - offset_coefficient(truth, *point) for point in points]
    b = [1e-3 * (slope_coefficient(found, *point) - slope_coefficient(truth, *point)) for point in points]
    assert np.sqrt(np.mean(np.square(a))) < 0.003
    assert np.sqrt(np.mean(np.square(b))) < 0.5
    for first, second in ((found.alpha_p1, found.alpha_p2), (found.beta_1, found.beta_2)):
        assert first + 100 * second == pytest.approx(1.0)


def test_most_lines_hold_the_truth_in_their_confidence_interval():
    truth = FrictionCoefficients()
    lines = stroke_lines(sawtooth(100.0), CONTACT)
    inside = [
        abs(line.a - offset_coefficient(truth, line.velocity, 100.0)) < line.a_interval + 0.002
        for line in lines
    ]
    assert np.mean(inside) > 0.8


@pytest.mark.parametrize(('sign', 'side'), [(1.0, 'positive'), (-1.0, 'negative')])
def test_one_direction_only_and_too_few_speeds_to_one_side_are_refused(sign, side):
    lines = stroke_lines(sawtooth(100.0), CONTACT)
    with pytest.raises(IdentificationError, match=f'only strokes to the {side} side'):
        fit_coefficients([line for line in lines if sign * line.velocity > 0])
    fewer = [line for line in lines if sign * line.velocity < 0 or abs(line.velocity) < 0.005]
    with pytest.raises(IdentificationError, match=f'2 speeds to the {side} side.* at least 4'):
        fit_coefficients(fewer)
    with pytest.raises(IdentificationError, match=f'{side} side only'):
        kind_of_motion(checked_recording('one way', TIME, sign * 1e-3 * TIME, 50.0 + np.sin(TIME), 100.0))


def test_recordings_are_kind_of_motion():
    assert kind_of_motion(ramp(noise=0.01)) == RAMP
    assert kind_of_motion(sawtooth(100.0)) == SAWTOOTH
    sine = checked_recording('sine', TIME, 1e-3 * np.sin(6 * TIME), 50 * np.cos(6 * TIME), 100.0)
    assert kind_of_motion(sine) == 'other motion'


X, F = 1e-3 * np.sin(6 * TIME), 50 * np.cos(6 * TIME)


@pytest.mark.parametrize(
    ('x', 'force', 'clamp', 'words'),
    [
        (0 * X, F, 100.0, 'displacement is constant .*sensor'),
        (X, 0 * F + 3, 100.0, 'friction force is constant'),
        (np.where(TIME > 2, X[2000], X), F, 100.0, 'stuck'),
        (np.where(TIME > 3, np.nan, X), F, 100.0, r'no number at sample 3001 \(1999 such'),
        (X * 1e3, F * 1e-3, 100.0, r'displacement spans 2 m.*by a factor of 1000'),
        (X, F * 1e-3, 100.0, 'in kN'),
        (X, F, 0.1, 'normal force in kN'),
        (X, F, -100.0, 'above 0 N'),
    ],
)  # fmt: skip
def test_bad_channels_are_refused_with_a_sentence(x, force, clamp, words):
    with pytest.raises(IdentificationError, match=words):
        checked_recording('bad', TIME, x, force, clamp)


def test_elastic_play_lingers_at_zero_then_rises_and_slides():
    x = np.concatenate([np.linspace(0, 5e-3, 500), np.linspace(5e-3, -5e-3, 1000)])
    force = elastic_play_force(np.array([0.5, 1.0, 1e5, 1e-3]), x, 1e-3, np.full((x.size, 2), 100.0))
    assert force[499] == pytest.approx(50.0)
    after = 5e-3 - x
    assert np.all(force[500:][(after[500:] > 0.6e-3) & (after[500:] < 2.4e-3)] == 0.0)
    assert force[-1] == pytest.approx(-100.0)


def test_dahl_becomes_coulomb_when_stiff():
    x = 1e-3 * np.sin(6 * TIME)
    loads = np.full((x.size, 2), 100.0)
    stiff = dahl_force(np.array([0.5, 0.4, 1e9]), x, 1e-3, loads)
    coulomb = coulomb_force(np.array([0.5, 0.4]), x, 1e-3, loads)
    moving = np.abs(np.gradient(x, TIME)) > 1e-3
    assert stiff[moving] == pytest.approx(coulomb[moving], abs=0.2)


def test_the_ladder_finds_the_law_that_made_the_data_and_judges_by_held_out_error():
    truth = np.array([0.5, 0.7, 2e5, 0.3e-3])
    train, other = (
        checked_recording(name, TIME, x, elastic_play_force(truth, x, 1e-3, np.full((x.size, 2), load)), load)
        for name, x, load in (('a', 3e-3 * np.sin(5 * TIME), 100.0), ('b', 2e-3 * np.sin(9 * TIME), 60.0))
    )
    coulomb, _, dahl, _, elastic_play = simple_laws([train])
    rungs = fit_ladder([coulomb, dahl, elastic_play], [train], [other])
    assert best_rung(rungs).law.name == 'Coulomb + elastic play'
    assert rungs[2].held_out_error < 0.02
    assert rungs[2].values == pytest.approx(truth, rel=0.05)
    assert rungs[0].held_out_error == law_error(coulomb, rungs[0].values, [other]) > 0.1
    assert law_error(coulomb, np.zeros(2), [train]) == pytest.approx(1.0)
