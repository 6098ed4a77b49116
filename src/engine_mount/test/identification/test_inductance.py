"""Gap curves from noisy ripple at known gaps: how near to the truth, and what temperature leaves."""

import functools
import re
from dataclasses import replace

import numpy as np
import pytest

from engine_mount.identification import gap_curves
from engine_mount.identification.gap_curves import RippleRecording, calibrate_gap_curves, measured_point
from engine_mount.identification.inductance import calibrate_inductance, measured_compensation
from mount_models.coil.correction import (
    check_compensation,
    crossing_at_calibration,
    inductance_at_calibration,
    temperature_share,
)
from mount_models.coil.crossing import find_crossing
from mount_models.coil.gap import evaluate
from mount_models.quantity import LawRefusedError, OutsideLawError
from mount_models.specimen import default_specimen
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients, coil_at, incremental_inductance

MAGNET, COIL = ReluctanceActuator(), RippleCoil()
GAPS = np.linspace(270e-6, 550e-6, 15)
CURRENTS = np.concatenate([np.full(1000, 0.2), np.linspace(0.2, 2.5, 1500)])
JUDGED = np.linspace(300e-6, 500e-6, 9)


@functools.lru_cache
def without_noise(celsius, gaps, coefficient):
    coil, currents = coil_at(COIL, TemperatureCoefficients(core=coefficient), celsius), CURRENTS.tolist()
    return np.array(
        [[incremental_inductance(coil, MAGNET, current, gap) for current in currents] for gap in gaps]
    )


def recorded(celsius=20.0, seed=0, noise=0.01, gaps=GAPS, coefficient=0.0043):
    clean = without_noise(celsius, tuple(gaps.tolist()), coefficient)
    inductance = clean * (1.0 + noise * np.random.default_rng(seed).standard_normal(clean.shape))
    return [
        RippleRecording(f'{gap * 1e6:.0f} um', float(gap), celsius, CURRENTS, row)
        for gap, row in zip(gaps, inductance, strict=True)
    ]


@functools.lru_cache
def truth(gap, celsius=20.0, coefficient=0.0043):
    coil = coil_at(COIL, TemperatureCoefficients(core=coefficient), celsius)
    currents = np.linspace(1.0, 2.4, 281)
    at_rest = incremental_inductance(coil, MAGNET, 0.2, gap)
    curve = [incremental_inductance(coil, MAGNET, current, gap) for current in currents]
    return at_rest, find_crossing(currents, curve, 20e-3, 0.2).current


def gap_errors(curves, celsius=20.0, compensation=None, coefficient=0.0043):
    """Return the largest errors at rest and at contact, um, against the simulated truth."""
    worst = [0.0, 0.0]
    for gap in JUDGED:
        inductance, crossing = truth(gap, celsius, coefficient)
        if compensation is not None:
            inductance = inductance_at_calibration(compensation, curves, inductance, celsius)
            crossing = crossing_at_calibration(compensation, curves, crossing, celsius)
        found = (
            evaluate(curves.gap_of_inductance, inductance),
            evaluate(curves.gap_of_crossing_current, crossing),
        )
        worst = [max(old, 1e6 * abs(float(value) - gap)) for old, value in zip(worst, found, strict=True)]
    return worst


@pytest.fixture(scope='module')
def recordings():
    return recorded()


@pytest.fixture(scope='module')
def points(recordings):
    return [measured_point(recording) for recording in recordings]


@pytest.fixture(scope='module')
def calibration(points):
    return calibrate_gap_curves(points)


@pytest.fixture(scope='module')
def compensation(calibration):
    warm = [measured_point(recording) for recording in recorded(80.0, gaps=GAPS[::2])]
    return measured_compensation(calibration.curves, 20.0, warm)


@pytest.mark.parametrize('seed', range(4))
def test_curves_from_noisy_ripple_meet_the_truth_within_a_micrometre(seed):
    found = calibrate_gap_curves([measured_point(recording) for recording in recorded(seed=seed)])
    assert max(gap_errors(found.curves)) <= 1.0


def test_the_stated_uncertainty_is_that_of_repeated_calibrations(monkeypatch):
    monkeypatch.setattr(gap_curves, '_HIGHEST_DEGREE', 2)
    found = [calibrate_gap_curves([measured_point(r) for r in recorded(seed=seed)]) for seed in range(8)]
    middle = [float(evaluate(each.curves.inductance_of_gap, 410e-6)) for each in found]
    stated = np.sqrt(found[0].inductance.covariance[0, 0])
    assert np.std(middle, ddof=1) == pytest.approx(stated, rel=0.7)


def test_a_gap_that_contradicts_the_others_is_refused_and_named(points):
    wrong = [p._replace(gap=p.gap + 15e-6) if p.name == '390 um' else p for p in points]
    with pytest.raises(LawRefusedError, match=r'390 um: by the .* off the given 405\.0 um'):
        calibrate_gap_curves(wrong)


def test_too_few_gaps_and_the_same_gap_twice_are_refused(points):
    with pytest.raises(LawRefusedError, match=r'6 or more air gaps .* 5 given'):
        calibrate_gap_curves(points[:5])
    with pytest.raises(LawRefusedError, match='differ by 1 um'):
        calibrate_gap_curves([*points, points[3]])


@pytest.mark.parametrize(
    ('part', 'sentence'),
    [
        (
            slice(None, None, 200),
            r'270 um: samples within 0\.02 A .* 20, 6 are: a table of few points',
        ),
        (slice(1100, None), r'270 um: samples within 0\.02 A of the rest current'),
        (slice(1300), '270 um: coil inductance must fall through'),
    ],
)
def test_a_table_and_a_recording_without_rest_or_crossing_are_refused(recordings, part, sentence):
    name, gap, celsius, current, inductance = recordings[0]
    with pytest.raises(LawRefusedError, match=sentence):
        measured_point(RippleRecording(name, gap, celsius, current[part], inductance[part]))


def test_a_curve_that_may_turn_within_its_scatter_is_refused(recordings):
    """At 0.9 A the same inductance belongs to two gaps (section 3.2)."""
    with pytest.raises(LawRefusedError, match=r'rest current must rise or fall steadily .*2 standard'):
        calibrate_gap_curves([measured_point(recording, rest_current=0.9) for recording in recordings])


def test_a_refused_crossing_inductance_comes_with_one_that_serves(recordings):
    """A coil of a third of the inductance: 20 mH are not reached at large gaps."""
    both = [
        each._replace(inductance=each.inductance / 3.0)
        for each in (*recordings, *recorded(80.0, gaps=GAPS[::2]))
    ]
    with pytest.raises(LawRefusedError, match=r'must fall through 20\.0 mH') as refusal:
        calibrate_inductance(both, default_specimen(), [])
    named = re.search(r'--crossing-inductance (\S+) serves', str(refusal.value))
    serving = replace(default_specimen(), crossing_inductance=float(named[1]) * 1e-3)
    assert calibrate_inductance(both, serving, []).calibration.crossing.gap_rms < 1e-6


def test_one_temperature_alone_is_refused_for_another_moves_the_gap(recordings):
    with pytest.raises(LawRefusedError, match=r'one coil temperature \(20 degC\).* at a second temperature'):
        calibrate_inductance(recordings, default_specimen(), [])


@pytest.mark.parametrize('celsius', [-20.0, 80.0])
def test_a_measured_compensation_leaves_little_of_what_temperature_does(calibration, compensation, celsius):
    rest, contact = gap_errors(calibration.curves, celsius)
    assert rest > 50.0
    assert contact > 20.0
    rest, contact = gap_errors(calibration.curves, celsius, compensation)
    assert rest <= 2.0
    assert contact <= (1.5 if celsius > 20.0 else 7.0)


@pytest.mark.parametrize('coefficient', [0.0034, 0.0052])
def test_a_wrong_coefficient_matters_little_where_two_temperatures_were_measured(calibration, coefficient):
    warm = [measured_point(r) for r in recorded(80.0, gaps=GAPS[::2], coefficient=coefficient)]
    found = measured_compensation(calibration.curves, 20.0, warm)
    assert max(gap_errors(calibration.curves, 80.0, found, coefficient)) <= 1.5
    assert max(gap_errors(calibration.curves, -20.0, found, coefficient)) <= 9.0


def test_at_the_temperature_of_the_curves_nothing_changes(calibration, compensation):
    assert temperature_share(compensation, 20.0) == 0.0
    assert temperature_share(compensation, 80.0) == pytest.approx(1.0)
    assert inductance_at_calibration(compensation, calibration.curves, 0.0461, 20.0) == 0.0461
    assert crossing_at_calibration(compensation, calibration.curves, 1.51, 20.0) == 1.51


def test_a_temperature_that_is_not_compensated_is_refused(calibration, compensation):
    with pytest.raises(
        OutsideLawError, match=r'coil temperature \(140\.0 degC\) must lie within -40\.0 \.\. 120'
    ):
        inductance_at_calibration(compensation, calibration.curves, 0.046, 140.0)


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'reference_celsius': 25.0}, r'must differ from calibration_celsius \(20 degC\) by 10 K'),
        ({'lowest_celsius': 30.0}, r'calibration_celsius \(20 degC\) must lie within'),
        ({'conductivity_coefficient': 0.02}, 'must leave the core a resistivity'),
    ],
)
def test_a_compensation_of_nonsense_is_refused(calibration, compensation, change, sentence):
    with pytest.raises(LawRefusedError, match=sentence):
        check_compensation(compensation._replace(**change), calibration.curves)
