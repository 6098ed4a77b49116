"""Fitting Eqs (3), (4) to force points of any actuator: how well, how sure, and what is refused."""

import math

import numpy as np
import pytest

from engine_mount.identification import force_law
from engine_mount.identification.force_law import ActuatorCalibration, fit_force_law
from engine_mount.identification.force_points import gap_groups
from mount_models.actuator import TABLE_1, ForceLaw, checked_force
from mount_models.quantity import LawRefusedError, OutsideLawError, with_values
from mount_models.specimen import default_specimen
from mount_sim.plant.reluctance import ReluctanceActuator, force

GAPS = np.arange(280, 541, 20)[:, np.newaxis] * 1e-6
CURRENTS = np.linspace(0.1, 3.0, 30)
MAGNET = ReluctanceActuator()
STRONG = 0.06  # of the largest force: 20 N of 330 N

PUBLISHED = ForceLaw(
    a1=(170.6821, -1.418155, 3.680460e-3, -3.106194e-6),
    a2=(64.38881, -1.245840e-2, -3.093237e-4, 3.706637e-7),
    a3=(5.679536, -3.109328e-2, 7.557801e-5, -6.140034e-8),
    a4=(0.5949966, 3.920621e-3),
    a5=(220.3978, -0.9054810, 1.363176e-3, -7.020985e-7),
    gap_low=280e-6,
    gap_high=540e-6,
    current_high=3.0,
)
"""An independent fit of the same law to the same magnet."""


def pull(magnet=MAGNET, gaps=GAPS, currents=CURRENTS):
    return np.array([[force(magnet, current, gap) for current in currents] for gap in gaps[:, 0]])


def with_noise(truth, seed, noise=0.01):
    return truth * (1.0 + noise * np.random.default_rng(seed).standard_normal(truth.shape))


def relative_rms(law, truth, gaps=GAPS, currents=CURRENTS):
    strong = truth > STRONG * truth.max()
    return float(np.sqrt(np.mean((checked_force(law, currents, gaps) / truth - 1.0)[strong] ** 2)))


@pytest.fixture(scope='module')
def measured():
    return pull()


@pytest.fixture(scope='module')
def fit(measured):
    return fit_force_law(GAPS, CURRENTS, measured)


@pytest.fixture(scope='module')
def repeated(measured):
    """Return fits to measurements that differ by their noise alone."""
    return [fit_force_law(GAPS, CURRENTS, with_noise(measured, seed)) for seed in range(10)]


def test_the_fit_finds_the_published_law_guarded_to_what_was_measured(fit):
    ours, theirs = (checked_force(law, CURRENTS, GAPS) for law in (fit.law, PUBLISHED))
    assert ours == pytest.approx(theirs, rel=2e-4, abs=2e-4)
    assert np.sqrt(np.mean(fit.relative**2)) == pytest.approx(0.0025, abs=0.00005)
    assert np.abs(fit.relative).max() == pytest.approx(0.007, abs=0.0005)
    assert [len(part) for part in fit.law[:5]] == [4, 4, 4, 2, 4]
    assert fit.law[5:] == pytest.approx((280e-6, 540e-6, 3.0))
    with pytest.raises(OutsideLawError):
        checked_force(fit.law, 1.0, 279e-6)
    figures = ActuatorCalibration(fit, default_specimen(), []).figures()
    assert figures['rms_error_n'] == pytest.approx(0.45, abs=0.005)
    assert figures['largest_error_n'] == pytest.approx(2.0, abs=0.05)


def test_forces_of_table_1_lead_back_to_table_1():
    gaps = np.linspace(200e-6, 520e-6, 9)[:, np.newaxis]
    found = fit_force_law(gaps, CURRENTS, checked_force(TABLE_1, CURRENTS, gaps))
    assert np.abs(found.relative).max() < 1e-8
    for ours, printed in zip(found.law[:5], TABLE_1[:5], strict=True):
        assert ours == pytest.approx(printed, rel=1e-6)


@pytest.mark.parametrize('seed', range(2))
def test_one_percent_of_noise_leaves_half_a_percent_of_error(seed):
    random = np.random.default_rng(seed)
    drawn = {
        name: value * random.uniform(0.9, 1.1) for name, value in MAGNET._asdict().items() if name != 'turns'
    }
    currents = np.linspace(0.1, 3.0, 59)
    truth = pull(with_values(MAGNET, **drawn), currents=currents)
    fit = fit_force_law(GAPS, currents, with_noise(truth, seed))
    assert relative_rms(fit.law, truth, currents=currents) <= 0.005
    assert np.sqrt(np.mean(fit.relative**2)) == pytest.approx(0.01, rel=0.15)


@pytest.mark.parametrize(('size', 'turns'), [(3.0, 300.0), (0.3, 800.0)])
def test_an_actuator_of_another_size_is_fitted_as_well(size, turns):
    magnet = with_values(
        MAGNET,
        turns=turns,
        gap_area=MAGNET.gap_area * size**2,
        core_length=MAGNET.core_length * size,
        residual_gap=MAGNET.residual_gap * size,
        leakage_permeance=MAGNET.leakage_permeance * size,
    )
    gaps, currents = GAPS * size, np.linspace(0.1, 3.0, 59) * size * MAGNET.turns / turns
    truth = pull(magnet, gaps, currents)
    fit = fit_force_law(gaps, currents, with_noise(truth, 0), force_floor=0.006 * truth.max())
    assert relative_rms(fit.law, truth, gaps, currents) <= 0.005


def test_the_covariance_is_the_scatter_of_fits_to_repeated_measurements_none_of_which_has_outliers(repeated):
    knees = np.array([fit.law.a4 for fit in repeated])
    stated = np.mean([np.sqrt(fit.covariance.diagonal()[12:14]) for fit in repeated], axis=0)
    assert knees.std(axis=0, ddof=1) == pytest.approx(stated, rel=0.6)


def test_outliers_are_refused_and_named(measured):
    spoiled = with_noise(measured, 1)
    spoiled[3, 10] *= 1.5
    spoiled[9, 20] *= 0.7
    with pytest.raises(LawRefusedError, match=r'2 of 420 points are outliers') as refusal:
        fit_force_law(GAPS, CURRENTS, spoiled)
    assert '340.0 um, 1.100 A' in str(refusal.value)
    assert '460.0 um, 2.100 A' in str(refusal.value)


def mixed(force):
    return np.random.default_rng(0).permutation(force.ravel()).reshape(force.shape)


def with_nan(force):
    return np.where(np.arange(force.size).reshape(force.shape) == 7, math.nan, force)


@pytest.mark.parametrize(
    ('gaps', 'currents', 'force', 'sentence'),
    [
        (GAPS, CURRENTS, mixed, r'must|of the same actuator'),
        (GAPS, CURRENTS, lambda f: f[::-1], 'must'),
        (GAPS, CURRENTS, with_nan, 'finite'),
        (GAPS, CURRENTS, lambda f: -f, 'sign of the load cell'),
        (GAPS, -CURRENTS, lambda f: f, 'polarity of the current sensor'),
        (GAPS[:4], CURRENTS, lambda f: f[:4], r'at least 5 air gaps, .*; 4 given'),
        (GAPS, CURRENTS[:7], lambda f: f[:, :7], r'8 currents or more; at 280\.0 um .* 7'),
        (GAPS[:1], CURRENTS[:2], lambda f: f[:1, :2], r'\(2\) must be at least 54'),
        (np.full_like(GAPS, 349e-6), CURRENTS, lambda f: f, 'at least 5 air gaps'),
        (0.36e-3 + 0.1 * GAPS, CURRENTS, lambda f: f, r'\(388\.0 \.\. 414\.0 um\) must span at least 10%'),
    ],
)
def test_points_that_give_no_law_are_refused(measured, gaps, currents, force, sentence):
    with pytest.raises(LawRefusedError, match=sentence):
        fit_force_law(gaps, currents, force(measured))


def test_gaps_that_scatter_a_little_are_one_gap():
    gaps = np.concatenate([300e-6 + 1e-7 * np.arange(5), 350e-6 + 1e-7 * np.arange(5)])
    assert [sorted(group.tolist()) for group in gap_groups(gaps)] == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]


def magnet_pull(current, gap):
    """A magnet by a formula of its own: the square of the ampere turns, bent by saturation."""
    field = current / (gap + 60e-6) / 6e3
    return 330.0 * field**2 / (1.0 + field**2)


def points_from(lowest):
    gaps = np.repeat(np.linspace(270e-6, 550e-6, 12), 24)
    currents = np.tile(np.linspace(lowest, 3.0, 24), 12)
    return gaps, currents, magnet_pull(currents, gaps)


def test_forces_from_0_2_ampere_on_give_a_law_with_the_measured_range_in_the_specimen(tmp_path):
    file = tmp_path / 'force.csv'
    file.write_text('gap_um\n')
    for lowest, continued in ((0.2, True), (0.0, False)):
        fit = fit_force_law(*points_from(lowest))
        assert fit.measured_from == (pytest.approx(0.2) if continued else 0.0)
        specimen = ActuatorCalibration(fit, default_specimen(), [file]).specimen('own')
        valid = specimen.provenance['parts']['force_law']['valid']
        assert valid.get('measured_current') == ([0.2, 3.0] if continued else None)
        for gap in (300e-6, 400e-6, 500e-6):
            for current in (0.06, 0.1, 0.15):
                expected = pytest.approx(magnet_pull(current, gap), abs=1.0)
                assert float(checked_force(fit.law, current, gap)) == expected


def test_a_law_that_fails_only_below_the_lowest_current_is_refused_for_that(monkeypatch):
    def fails_below(law, lowest_current=0.0):
        if lowest_current < 0.5:
            raise LawRefusedError('the force must be positive; at 293 um and 0.05 A it does not: look again')

    monkeypatch.setattr(force_law, 'check_force_law', fails_below)
    with pytest.raises(LawRefusedError, match=r'measured from 0\.80 A on only.*measure from 0\.05 A on'):
        fit_force_law(*points_from(0.8))
    with pytest.raises(LawRefusedError, match='look again'):
        fit_force_law(*points_from(0.0))
