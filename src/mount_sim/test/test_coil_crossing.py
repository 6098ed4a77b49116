"""Finding the 20 mH crossing in a measured curve: exact, honest about noise, unmoved by outliers."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from mount_models.coil.crossing import CrossingError, find_crossing
from mount_sim.plant.closing import ClosingMechanics, closed_state
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

MAGNET, COIL = ReluctanceActuator(), RippleCoil()
RAMP = np.linspace(0.0, 2.0, 1001)


def fixed_gap_curve(currents, gap=349e-6):
    return np.array([incremental_inductance(COIL, MAGNET, current, gap) for current in currents])


def assembled_curve(currents):
    mechanics, gap, inductances = ClosingMechanics(), 508e-6, []
    for current in currents:
        gap, _ = closed_state(mechanics, MAGNET, current, gap)
        inductances.append(incremental_inductance(COIL, MAGNET, current, gap))
    return np.array(inductances)


ASSEMBLED = assembled_curve(RAMP)


@pytest.mark.parametrize('gap_um', [250, 349, 492, 550])
def test_without_noise_the_crossing_is_found_to_a_fraction_of_a_milliampere(gap_um):
    exact = brentq(
        lambda current: incremental_inductance(COIL, MAGNET, current, gap_um * 1e-6) - 20e-3, 0.2, 2.5
    )
    found = find_crossing(RAMP, fixed_gap_curve(RAMP, gap_um * 1e-6))
    assert found.current == pytest.approx(exact, abs=1e-4)
    assert found.current_std < 1e-4


def test_the_stated_standard_deviation_is_that_of_repeated_measurements():
    random = np.random.default_rng(2)
    exact = find_crossing(RAMP, ASSEMBLED).current
    found = [
        find_crossing(RAMP, ASSEMBLED * (1.0 + 0.01 * random.standard_normal(RAMP.size))) for _ in range(200)
    ]
    currents = np.array([one.current for one in found])
    stated = np.mean([one.current_std for one in found])
    assert np.std(currents) == pytest.approx(stated, rel=0.2)
    assert np.mean(currents) == pytest.approx(exact, abs=4 * stated / math.sqrt(200))


@pytest.mark.parametrize('seed', range(8))
def test_not_even_every_fourth_sample_struck_to_one_side_moves_the_crossing(seed):
    random = np.random.default_rng(seed)
    noisy = ASSEMBLED * (1.0 + 0.01 * random.standard_normal(RAMP.size))
    clean = find_crossing(RAMP, noisy)
    struck = (np.abs(RAMP - clean.current) < 0.1) & (random.random(RAMP.size) < 0.25)
    spoiled = np.where(struck, noisy * random.uniform(3.0, 5.0, RAMP.size), noisy)
    assert find_crossing(RAMP, spoiled).current == pytest.approx(clean.current, abs=3 * clean.current_std)


def test_a_ramp_that_ends_too_early_is_refused_with_what_was_seen():
    early = RAMP < 1.2
    with pytest.raises(
        CrossingError, match=r'must fall through 20\.0 mH; instead it lay within .* ramp reach further'
    ):
        find_crossing(RAMP[early], ASSEMBLED[early])


def test_too_few_samples_are_refused():
    with pytest.raises(CrossingError, match='only 3 valid samples'):
        find_crossing(RAMP[:3], ASSEMBLED[:3])
    with pytest.raises(CrossingError, match=r'different currents within .* must be at least 7'):
        find_crossing(RAMP[::40], ASSEMBLED[::40])
