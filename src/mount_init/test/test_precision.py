"""Estimated gaps and force table against the truth of the simulated actuator."""

import numpy as np
import pytest
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation

from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters

# Below some 320 um the halves snap shut; the widest travels are among the pairs.
GAPS_UM = [
    (300, 540),
    (300, 480),
    (320, 500),
    (340, 520),
    (360, 490),
    (380, 540),
    (400, 480),
    (420, 510),
    (440, 480),
    (440, 540),
]
SEEDS = range(20)
MS = 1_000_000


@pytest.fixture(scope='module')
def recorded():
    """Return a function that gives the noise-free samples of a whole ramp, shape (N, 3), and the plant."""

    def record(contact_um, rest_um):
        plant = SimulatedActuator(contact_um * 1e-6, rest_um * 1e-6)
        initialisation, samples = Initialisation(SPECIMEN, InitParameters()), []
        while not initialisation.finished:
            samples.append(plant.sample())
            plant.follow(initialisation.step(len(samples) * MS, *samples[-1]))
        return np.array(samples), plant

    return record


def estimate(samples):
    initialisation = Initialisation(SPECIMEN, InitParameters())
    for number, sample in enumerate(samples.tolist()):
        initialisation.step(number * MS, *sample)
    return initialisation.result()


def with_ripple_noise(samples, seed):
    """Return the samples with 1 % of scatter on L_i."""
    noisy = samples.copy()
    noisy[:, 1] /= 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(len(samples))
    return noisy


def table_error(result, plant):
    """Return the relative rms error of the table's normal force above 20 N."""
    truth = plant.true_normal_force(result.table[0])
    strong = truth > 20.0
    return np.sqrt(np.mean((result.table[1][strong] / truth[strong] - 1.0) ** 2))


@pytest.mark.parametrize(('contact_um', 'rest_um'), GAPS_UM)
def test_gaps_and_table_meet_the_truth_without_and_with_noise(recorded, contact_um, rest_um):
    samples, plant = recorded(contact_um, rest_um)

    exact = estimate(samples)
    assert exact.rest_gap * 1e6 == pytest.approx(rest_um, abs=1.0)
    assert exact.contact_gap * 1e6 == pytest.approx(contact_um, abs=0.1)
    assert exact.contact_force == pytest.approx(1.4e-1 * (rest_um - contact_um), rel=0.015)
    assert table_error(exact, plant) < 0.01

    noisy = [estimate(with_ripple_noise(samples, 1000 * contact_um + seed)) for seed in SEEDS]
    rest_error = np.array([result.rest_gap * 1e6 - rest_um for result in noisy])
    contact_error = np.array([result.contact_gap * 1e6 - contact_um for result in noisy])
    assert np.abs(rest_error).max() < 4.0
    assert np.abs(contact_error).max() < 2.0
    # the stated standard deviations are true: 20 draws scatter by up to half of it
    assert np.mean([result.rest_gap_std * 1e6 for result in noisy]) == pytest.approx(
        rest_error.std(), rel=0.5
    )
    assert np.mean([result.contact_gap_std * 1e6 for result in noisy]) == pytest.approx(
        contact_error.std(), rel=0.5
    )


def test_prototype_of_the_paper_is_found():
    result = run_initialisation(SimulatedActuator())
    assert result.contact_gap * 1e6 == pytest.approx(349.0, abs=0.1)
    assert result.rest_gap * 1e6 == pytest.approx(508.0, abs=1.0)
    # section 3.2 measures 492 um at 0.2 A
    assert result.evidence.rest.at_rest_current * 1e6 == pytest.approx(492.0, abs=0.2)
    # there the pads are pressed already
    assert result.evidence.contact.at_crossing * 1e6 == pytest.approx(341.2, abs=0.1)
    assert result.contact_force == pytest.approx(22.26, rel=0.01)
    assert result.offset_current == pytest.approx(0.4777, rel=0.01)  # 0.5 N past touching
    assert result.table[1, -1] == pytest.approx(304.8, rel=0.01)
    assert result.table[0, 0] == pytest.approx(0.4725, rel=0.01)


def test_outliers_do_not_pull_the_estimates(recorded):
    samples = with_ripple_noise(recorded(349, 508)[0], 1)
    random = np.random.default_rng(2)
    hit = random.random(len(samples)) < 0.03
    samples[hit, 1] *= random.choice([0.3, 3.0], size=hit.sum())
    result = estimate(samples)
    assert result.rest_gap * 1e6 == pytest.approx(508.0, abs=4.0)
    assert result.contact_gap * 1e6 == pytest.approx(349.0, abs=2.0)


def test_samples_with_nan_are_skipped_and_counted(recorded):
    samples = recorded(349, 508)[0]
    samples[::10, 0] = np.nan
    samples[5::10, 2] = np.inf
    result = estimate(samples)
    assert result.evidence.skipped == 550
    assert result.evidence.samples == len(samples) - 550
    assert result.rest_gap * 1e6 == pytest.approx(508.0, abs=1.0)
    assert result.contact_gap * 1e6 == pytest.approx(349.0, abs=0.2)


@pytest.mark.parametrize('celsius', [-20.0, 80.0])
def test_gaps_are_compensated_for_the_temperature_of_the_coil(celsius):
    """Contact at -20 degC is extrapolated from 80 degC; without compensation tens of um are left."""
    parameters = InitParameters(coil_temperature_celsius=celsius, peak_current=2.5)
    result = run_initialisation(SimulatedActuator(celsius=celsius), SPECIMEN, parameters)
    assert result.rest_gap == pytest.approx(508e-6, abs=3e-6)
    assert result.contact_gap == pytest.approx(349e-6, abs=6e-6)
