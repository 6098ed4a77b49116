"""Force points of any actuator: where the search starts, what is refused, and how sure the result is."""

import numpy as np
import pytest

from engine_mount.identification.actuator.fit import fit_force_law
from engine_mount.identification.actuator.points import gap_groups
from mount_models.actuator.law import checked_force
from mount_models.quantity import LawRefusedError, with_values
from mount_sim.plant.reluctance import ReluctanceActuator, force

GAPS = np.linspace(270e-6, 550e-6, 15)[:, np.newaxis]
CURRENTS = np.linspace(0.1, 3.0, 59)
STRONG = 0.06  # of the largest force: 20 N of 330 N


def measured(magnet, gaps=GAPS, currents=CURRENTS, noise=0.0, seed=0):
    truth = np.array([[force(magnet, current, gap) for current in currents] for gap in gaps[:, 0]])
    return truth, truth * (1.0 + noise * np.random.default_rng(seed).standard_normal(truth.shape))


def relative_rms(law, truth, gaps=GAPS, currents=CURRENTS):
    strong = truth > STRONG * truth.max()
    return float(np.sqrt(np.mean((checked_force(law, currents, gaps) / truth - 1.0)[strong] ** 2)))


@pytest.fixture(scope='module')
def noisy():
    return measured(ReluctanceActuator(), noise=0.01, seed=1)


@pytest.fixture(scope='module')
def repeated():
    """Return fits to measurements that differ by their noise alone, every third current of the others."""
    truth, _ = measured(ReluctanceActuator(), currents=CURRENTS[::3])
    random = np.random.default_rng(1)
    return [
        fit_force_law(GAPS, CURRENTS[::3], truth * (1.0 + 0.01 * random.standard_normal(truth.shape)))
        for _ in range(10)
    ]


@pytest.mark.parametrize('seed', range(3))
def test_one_percent_of_noise_leaves_half_a_percent_of_error(seed):
    random = np.random.default_rng(seed)
    drawn = {
        name: value * random.uniform(0.9, 1.1)
        for name, value in ReluctanceActuator()._asdict().items()
        if name != 'turns'
    }
    truth, noisy = measured(with_values(ReluctanceActuator(), **drawn), noise=0.01, seed=seed)
    fit = fit_force_law(GAPS, CURRENTS, noisy)
    assert relative_rms(fit.law, truth) <= 0.005
    assert fit.relative_rms == pytest.approx(0.01, rel=0.15)


@pytest.mark.parametrize(('size', 'turns'), [(3.0, 300.0), (0.3, 800.0)])
def test_an_actuator_of_another_size_is_fitted_as_well(size, turns):
    paper = ReluctanceActuator()
    magnet = with_values(
        paper,
        turns=turns,
        gap_area=paper.gap_area * size**2,
        core_length=paper.core_length * size,
        residual_gap=paper.residual_gap * size,
        leakage_permeance=paper.leakage_permeance * size,
    )
    currents = CURRENTS * size * paper.turns / turns
    truth, noisy = measured(magnet, GAPS * size, currents, noise=0.01)
    fit = fit_force_law(GAPS * size, currents, noisy, force_floor=0.006 * truth.max())
    assert relative_rms(fit.law, truth, GAPS * size, currents) <= 0.005


def test_other_orders_of_the_polynomials_can_be_chosen(noisy):
    fit = fit_force_law(GAPS, CURRENTS, noisy[1], orders=(4, 4, 4, 3, 5))
    assert [len(part) for part in fit.law[:5]] == [4, 4, 4, 3, 5]
    assert fit.covariance.shape == (20, 20)


def test_the_covariance_tells_the_scatter_of_fits_to_repeated_measurements(repeated):
    knees = np.array([fit.law.a4 for fit in repeated])
    stated = np.mean([np.sqrt(fit.covariance.diagonal()[12:14]) for fit in repeated], axis=0)
    assert knees.std(axis=0, ddof=1) == pytest.approx(stated, rel=0.6)


def test_outliers_are_refused_and_named(noisy):
    spoiled = noisy[1].copy()
    spoiled[3, 20] *= 1.5
    spoiled[9, 40] *= 0.7
    with pytest.raises(LawRefusedError, match=r'2 of 885 points are outliers') as refusal:
        fit_force_law(GAPS, CURRENTS, spoiled)
    assert '330.0 um, 1.100 A' in str(refusal.value)
    assert '450.0 um, 2.100 A' in str(refusal.value)


def test_noise_alone_is_no_outlier(repeated):
    assert {fit.points for fit in repeated} == {GAPS.size * CURRENTS[::3].size}


def test_forces_of_no_such_actuator_are_refused_as_a_whole(noisy):
    mixed = np.random.default_rng(0).permutation(noisy[1].ravel()).reshape(noisy[1].shape)
    with pytest.raises(LawRefusedError, match=r'must|of the same actuator'):
        fit_force_law(GAPS, CURRENTS, mixed)


@pytest.mark.parametrize(
    ('rows', 'columns', 'sentence'),
    [
        (slice(0, 4), slice(None), r'at least 5 air gaps, .*; 4 given'),
        (slice(None), slice(0, 7), r'8 currents or more; at 270\.0 um there are 7'),
        (slice(0, 1), slice(0, 2), r'force measurements \(2\) must be at least 54'),
    ],
)
def test_too_little_is_refused(noisy, rows, columns, sentence):
    with pytest.raises(LawRefusedError, match=sentence):
        fit_force_law(GAPS[rows], CURRENTS[columns], noisy[1][rows, columns])


def test_gaps_too_close_together_are_refused(noisy):
    close = 400e-6 + 0.1 * (GAPS - 400e-6)
    with pytest.raises(LawRefusedError, match=r'air gaps \(387\.0 \.\. 415\.0 um\) must span at least 10%'):
        fit_force_law(close, CURRENTS, noisy[1])


def test_forces_of_wrong_sign_are_refused(noisy):
    with pytest.raises(LawRefusedError, match='sign of the load cell'):
        fit_force_law(GAPS, CURRENTS, -noisy[1])


def test_currents_of_wrong_sign_are_refused(noisy):
    with pytest.raises(LawRefusedError, match='polarity of the current sensor'):
        fit_force_law(GAPS, -CURRENTS, noisy[1])


def test_orders_out_of_range_are_refused(noisy):
    with pytest.raises(LawRefusedError, match=r'orders \(4, 4, 0, 2, 4\) must be five numbers'):
        fit_force_law(GAPS, CURRENTS, noisy[1], orders=(4, 4, 0, 2, 4))


def test_gaps_that_scatter_a_little_are_one_gap():
    gaps = np.concatenate([300e-6 + 1e-7 * np.arange(5), 350e-6 + 1e-7 * np.arange(5)])
    assert [sorted(group.tolist()) for group in gap_groups(gaps)] == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]
