"""Fitting Eqs (3), (4) to the simulated magnet: how well, and what is refused."""

import math

import numpy as np
import pytest

from engine_mount.identification.actuator.fit import fit_force_law
from engine_mount.identification.specimen import with_force_law
from mount_models.actuator.law import TABLE_1, ForceLaw, checked_force
from mount_models.quantity import LawRefusedError, OutsideLawError
from mount_models.specimen import default_specimen
from mount_sim.plant.reluctance import ReluctanceActuator, force

GAPS = np.arange(280, 541, 20)[:, np.newaxis] * 1e-6
CURRENTS = np.linspace(0.1, 3.0, 30)

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


@pytest.fixture(scope='module')
def measured():
    magnet = ReluctanceActuator()
    return np.array([[force(magnet, current, gap) for current in CURRENTS] for gap in GAPS[:, 0]])


@pytest.fixture(scope='module')
def fit(measured):
    return fit_force_law(GAPS, CURRENTS, measured)


def test_the_fit_meets_the_measured_force_within_its_targets(fit):
    assert fit.relative_rms <= 0.005
    assert fit.worst <= 0.01


def test_the_fit_is_as_good_as_the_published_one(fit):
    assert fit.relative_rms == pytest.approx(0.0025, abs=0.00005)
    assert fit.worst == pytest.approx(0.007, abs=0.0005)
    assert fit.rms_error == pytest.approx(0.45, abs=0.005)
    assert fit.largest_error == pytest.approx(2.0, abs=0.05)


def test_the_fit_finds_the_same_law_as_the_published_one(fit):
    ours, theirs = (checked_force(law, CURRENTS, GAPS) for law in (fit.law, PUBLISHED))
    assert ours == pytest.approx(theirs, rel=2e-4, abs=2e-4)


def test_the_figures_of_the_fit_are_those_of_its_law(fit, measured):
    error = checked_force(fit.law, CURRENTS, GAPS) - measured
    relative = (error / measured)[measured > 20.0]
    assert fit.worst == pytest.approx(np.abs(relative).max(), rel=1e-12)
    assert fit.gap_rms == pytest.approx(np.sqrt(np.mean(error**2, axis=1)), rel=1e-12)
    assert fit.gaps == pytest.approx(GAPS[:, 0])


def test_the_law_has_18_parameters_and_is_guarded_to_what_was_measured(fit):
    assert [len(part) for part in fit.law[:5]] == [4, 4, 4, 2, 4]
    assert fit.law.gap_low == pytest.approx(280e-6)
    assert fit.law.gap_high == pytest.approx(540e-6)
    assert fit.law.current_high == 3.0
    with pytest.raises(OutsideLawError):
        checked_force(fit.law, 1.0, 279e-6)


def test_forces_of_table_1_lead_back_to_table_1():
    gaps = np.linspace(200e-6, 520e-6, 9)[:, np.newaxis]
    found = fit_force_law(gaps, CURRENTS, checked_force(TABLE_1, CURRENTS, gaps))
    assert found.relative_rms < 1e-9
    for ours, printed in zip(found.law[:5], TABLE_1[:5], strict=True):
        assert ours == pytest.approx(printed, rel=1e-6)


def test_measurements_with_noise_still_meet_the_target(measured):
    noise = np.random.default_rng(1).standard_normal(measured.shape)
    found = fit_force_law(GAPS, CURRENTS, measured + 0.3 * noise)
    clean = checked_force(found.law, CURRENTS, GAPS)
    strong = measured > 20.0
    assert math.sqrt(np.mean((clean / measured - 1.0)[strong] ** 2)) <= 0.005


def test_fewer_coefficients_fit_less_well(measured, fit):
    assert fit_force_law(GAPS, CURRENTS, measured, orders=(4, 4, 4, 2, 3)).rms_error > 1.1 * fit.rms_error


def test_too_few_coefficients_are_refused_as_they_give_no_law(measured):
    with pytest.raises(LawRefusedError, match='fall with the air gap'):
        fit_force_law(GAPS, CURRENTS, measured, orders=(3, 3, 3, 2, 3))


def test_forces_that_rise_with_the_gap_are_refused(measured):
    with pytest.raises(LawRefusedError, match='must'):
        fit_force_law(GAPS, CURRENTS, measured[::-1])


def test_too_few_points_are_refused(measured):
    with pytest.raises(LawRefusedError, match=r'force measurements \(42\) must be at least 54'):
        fit_force_law(GAPS, CURRENTS[::10], measured[:, ::10])


def test_points_that_failed_are_refused(measured):
    spoiled = measured.copy()
    spoiled[3, 3] = math.nan
    with pytest.raises(LawRefusedError, match='finite'):
        fit_force_law(GAPS, CURRENTS, spoiled)


def test_a_single_gap_is_refused(measured):
    with pytest.raises(LawRefusedError, match='at least 5 air gaps'):
        fit_force_law(np.full_like(measured, 349e-6), CURRENTS, measured)


def magnet_pull(current, gap):
    """A magnet by a formula of its own: the square of the ampere turns, bent by saturation."""
    field = current / (gap + 60e-6) / 6e3
    return 330.0 * field**2 / (1.0 + field**2)


def points_from(lowest):
    gaps = np.repeat(np.linspace(270e-6, 550e-6, 12), 24)
    currents = np.tile(np.linspace(lowest, 3.0, 24), 12)
    return gaps, currents, magnet_pull(currents, gaps)


def test_forces_from_0_2_ampere_on_are_taken_and_the_range_is_told(tmp_path):
    fit = fit_force_law(*points_from(0.2))
    assert fit.continued
    assert fit.lowest_current == pytest.approx(0.2)
    for gap in (300e-6, 400e-6, 500e-6):
        for current in (0.06, 0.1, 0.15):
            assert float(checked_force(fit.law, current, gap)) == pytest.approx(
                magnet_pull(current, gap), abs=1.0
            )
    file = tmp_path / 'force.csv'
    file.write_text('gap_um\n')
    entry = with_force_law(default_specimen(), 'own', fit, [file]).provenance['parts']['force_law']
    assert entry['valid']['measured_current'] == [0.2, 3.0]
    whole = fit_force_law(*points_from(0.0))
    assert not whole.continued
    entry = with_force_law(default_specimen(), 'own', whole, [file]).provenance['parts']['force_law']
    assert 'measured_current' not in entry['valid']


def test_a_law_that_fails_only_below_the_lowest_current_is_refused_for_that(monkeypatch):
    from engine_mount.identification.actuator import fit as module

    def fails_below(law, lowest_current=0.0):
        if lowest_current < 0.5:
            raise LawRefusedError('the force must be positive; at 293 um and 0.05 A it does not: look again')

    monkeypatch.setattr(module, 'check_force_law', fails_below)
    with pytest.raises(LawRefusedError, match=r'measured from 0\.80 A on only.*measure from 0\.05 A on'):
        fit_force_law(*points_from(0.8))
    with pytest.raises(LawRefusedError, match='look again'):
        fit_force_law(*points_from(0.0))
