"""Fitting Eqs (3), (4) to force points of any actuator: how well, how sure, and what is refused."""

import math

import numpy as np
import pytest

from engine_mount.identification.force_law import ActuatorCalibration, fit_force_law
from engine_mount.identification.force_points import gap_groups
from mount_models.actuator import TABLE_1, ForceLaw, check_force_law, checked_force
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
        (GAPS, CURRENTS, mixed, 'of the same actuator'),
        (GAPS, CURRENTS, lambda f: f[::-1], 'must fall with the air gap'),
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


def synthetic(strongest, gaps, currents, saturation=math.inf, noise=0.005, zero=0.0, seed=0):
    """Return gaps, currents, true and measured forces of a magnet with 100 um of residual gap."""
    gap, current = gaps[:, np.newaxis] * 1e-6, currents
    field = current / current.max() * (gap.min() + 100e-6) / (gap + 100e-6)
    truth = strongest * field**2 / (1.0 + (field / saturation) ** 2)
    random = np.random.default_rng(seed).standard_normal((2, *truth.shape))
    return gap, current, truth, truth * (1.0 + noise * random[0]) + strongest * (1e-4 * random[1] + zero)


SYNTHETIC = {
    'no saturation, small': (
        synthetic(10.0, np.linspace(100, 500, 8), np.linspace(0.03, 1.5, 12), noise=0.01), '',
    ),
    'no saturation, large': (
        synthetic(2000.0, np.linspace(600, 3000, 10), np.linspace(0.2, 12.0, 25), noise=0.001), '',
    ),
    'no saturation, few gaps': (synthetic(300.0, np.linspace(200, 600, 5), np.linspace(0.1, 3.0, 20)), ''),
    'no saturation, few currents': (
        synthetic(300.0, np.linspace(200, 600, 10), np.linspace(0.1, 3.0, 8), noise=0.02), '',
    ),
    'noise': (synthetic(330.0, np.linspace(250, 550, 12), np.linspace(0.06, 3.0, 24), 0.6, 0.02), ''),
    'deep saturation': (synthetic(120.0, np.linspace(200, 900, 12), np.linspace(0.1, 6.0, 30), 0.3), ''),
    'saturation, few currents': (
        synthetic(500.0, np.linspace(200, 500, 12), np.linspace(0.08, 4.0, 9), 0.7), '',
    ),
    'zero': (
        synthetic(330.0, np.linspace(250, 550, 12), np.linspace(0.06, 3.0, 24), 0.8, zero=0.02),
        r'force at 0 A \(6\.\d\d N .* zero of the load cell',
    ),
}  # fmt: skip


@pytest.mark.parametrize(('points', 'refusal'), SYNTHETIC.values(), ids=SYNTHETIC)
def test_any_actuator_is_identified_within_its_noise_or_refused_for_its_reason(points, refusal):
    gap, current, truth, force = points
    if refusal:
        with pytest.raises(LawRefusedError, match=refusal):
            fit_force_law(gap, current, force, 0.006 * force.max())
        return
    fit = fit_force_law(gap, current, force, 0.006 * force.max())
    noise = np.sqrt(np.mean((force - truth) ** 2))
    assert np.sqrt(np.mean(fit.error**2)) <= 1.4 * noise
    assert np.sqrt(np.mean((checked_force(fit.law, current, gap) - truth) ** 2)) <= noise
    check_force_law(fit.law)


def test_a_law_without_saturation_is_right_between_the_gaps_and_states_its_doubt():
    gap, current, truth, _ = synthetic(300.0, np.linspace(200, 600, 5), np.linspace(0.1, 3.0, 20))
    fits = [
        fit_force_law(gap, current, synthetic(300.0, gap[:, 0] * 1e6, current, seed=seed)[3], 1.8)
        for seed in range(8)
    ]
    between = np.linspace(200e-6, 600e-6, 97)[:, np.newaxis]
    expected = truth[0, -1] * ((300e-6) / (between + 100e-6)) ** 2
    found = np.array([checked_force(fit.law, current[-1], between) for fit in fits])
    assert found == pytest.approx(np.broadcast_to(expected, found.shape), rel=0.01)
    powers = np.pi * current[-1] ** 2 * 400.0 ** np.arange(len(fits[0].law.a5))
    stated = np.sqrt(powers @ fits[0].covariance[4:, 4:] @ powers)
    assert found[:, 48, 0].std(ddof=1) == pytest.approx(stated, rel=0.7)
