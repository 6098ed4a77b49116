"""The calibrated gap curves: how near they come to the simulated coil, their inverses and their guards."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from engine_mount.identification.gap_curves import GapPoint, calibrate_gap_curves
from mount_models.coil.gap import (
    check_gap_curves,
    crossing_current_from_gap,
    gap_from_crossing_current,
    gap_per_crossing_current,
    gap_per_inductance,
    inductance_from_gap,
    measured_inductance,
    rest_gap_from_inductance,
)
from mount_models.quantity import LawRefusedError, OutsideLawError, with_values
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

MAGNET = ReluctanceActuator()
COIL = RippleCoil()
GAPS = np.linspace(250e-6, 550e-6, 31)


def at_rest(gap, coil=COIL):
    return incremental_inductance(coil, MAGNET, 0.2, gap)


def crossing(gap, coil=COIL):
    return brentq(lambda current: incremental_inductance(coil, MAGNET, current, gap) - 20e-3, 0.2, 2.5)


INDUCTANCES = np.array([at_rest(gap) for gap in GAPS])
CROSSINGS = np.array([crossing(gap) for gap in GAPS])


def fitted(inductances):
    """Return the calibration through points without noise."""
    rows = zip(GAPS.tolist(), inductances, CROSSINGS, strict=True)
    return calibrate_gap_curves(
        [GapPoint(f'{gap * 1e6:.0f} um', gap, 20.0, each, 0.0, i20, 0.0) for gap, each, i20 in rows]
    )


FIT = fitted(INDUCTANCES)
CURVES = FIT.curves


def test_every_curve_meets_its_measurements_within_a_tenth_of_a_micrometre():
    assert max(np.abs(fit.gap_errors).max() for fit in (FIT.inductance, FIT.crossing)) <= 0.1e-6
    between = np.linspace(255e-6, 545e-6, 30)
    from_rest = rest_gap_from_inductance(CURVES, [at_rest(gap) for gap in between])
    from_crossing = gap_from_crossing_current(CURVES, [crossing(gap) for gap in between])
    assert from_rest == pytest.approx(between, abs=0.1e-6)
    assert from_crossing == pytest.approx(between, abs=0.1e-6)


@settings(deadline=None)
@given(gap=st.floats(250e-6, 550e-6))
def test_a_curve_and_its_inverse_lead_back_to_the_gap(gap):
    inductance = np.clip(inductance_from_gap(CURVES, gap), INDUCTANCES.min(), INDUCTANCES.max())
    current = np.clip(crossing_current_from_gap(CURVES, gap), CROSSINGS.min(), CROSSINGS.max())
    assert rest_gap_from_inductance(CURVES, inductance) == pytest.approx(gap, abs=0.2e-6)
    assert gap_from_crossing_current(CURVES, current) == pytest.approx(gap, abs=0.2e-6)


@settings(deadline=None)
@given(gap=st.floats(260e-6, 540e-6))
def test_derivatives_are_those_of_the_curves(gap):
    inductance, current = inductance_from_gap(CURVES, gap), crossing_current_from_gap(CURVES, gap)
    steps = np.array([-1e-6, 1e-6])
    by_inductance = np.diff(rest_gap_from_inductance(CURVES, inductance + steps))[0] / 2e-6
    by_current = np.diff(gap_from_crossing_current(CURVES, current + steps))[0] / 2e-6
    assert gap_per_inductance(CURVES, inductance) == pytest.approx(by_inductance, rel=1e-6)
    assert gap_per_crossing_current(CURVES, current) == pytest.approx(by_current, rel=1e-6)


def test_derivatives_meet_the_published_sensitivities():
    per_henry = gap_per_inductance(CURVES, inductance_from_gap(CURVES, 492e-6))
    per_ampere = gap_per_crossing_current(CURVES, crossing_current_from_gap(CURVES, 349e-6))
    assert 1.0 / per_henry == pytest.approx(-30.3, abs=0.1)  # H/m: 0.0303 mH/um
    assert 1e-3 / per_ampere == pytest.approx(2.12, abs=0.01)  # mA/um


def test_8_per_cent_less_conductivity_misleads_both_gaps_as_published():
    warm = with_values(COIL, conductivity=0.92 * COIL.conductivity)
    at_349 = rest_gap_from_inductance(CURVES, at_rest(349e-6, warm)) - 349e-6
    at_492 = rest_gap_from_inductance(CURVES, at_rest(492e-6, warm)) - 492e-6
    contact = gap_from_crossing_current(CURVES, crossing(349e-6, warm)) - 349e-6
    assert 1e6 * at_349 == pytest.approx(-27, abs=0.5)
    assert 1e6 * at_492 == pytest.approx(-27, abs=0.5)
    assert 1e6 * contact == pytest.approx(12, abs=0.5)


@pytest.mark.parametrize(
    ('function', 'value', 'sentence'),
    [
        (
            rest_gap_from_inductance,
            41e-3,
            r'rest inductance \(41\.000 mH\) must lie within 41\.404 \.\. 52\.260 mH',
        ),
        (rest_gap_from_inductance, math.nan, 'rest inductance'),
        (inductance_from_gap, 560e-6, r'air gap \(560\.000 um\) must lie within 250\.000 \.\. 550\.000 um'),
        (
            gap_from_crossing_current,
            1.1,
            r'crossing current \(1\.100 A\) must lie within 1\.169 \.\. 1\.755 A',
        ),
        (crossing_current_from_gap, 249e-6, 'air gap'),
    ],
)
def test_beyond_the_calibration_each_function_refuses_in_a_sentence(function, value, sentence):
    with pytest.raises(OutsideLawError, match=sentence):
        function(CURVES, value)
    with pytest.raises(OutsideLawError, match='calibrate over a wider range'):
        function(CURVES, np.array([value]))


def test_measured_inductance_normalises_by_turns_and_area():
    assert measured_inductance(0.11808, 100.0, 250.0) == pytest.approx(0.047232)
    rates = measured_inductance(0.1, [1.0, 2.0], [10.0, 0.0])
    assert rates[0] == pytest.approx(0.01)
    assert math.isnan(rates[1])


def test_an_ambiguous_curve_is_refused():
    at_0_8 = [incremental_inductance(COIL, MAGNET, 0.8, gap) for gap in GAPS]
    with pytest.raises(LawRefusedError, match='must rise or fall steadily with the gap'):
        fitted(at_0_8)


def test_curves_that_contradict_their_inverse_or_have_a_range_in_falling_order_are_refused():
    shifted = CURVES.gap_of_inductance
    shifted = shifted._replace(coefficients=(shifted.coefficients[0] + 5e-6, *shifted.coefficients[1:]))
    with pytest.raises(LawRefusedError, match=r'must agree within 2\.0 um; they differ by 5\.'):
        check_gap_curves(CURVES._replace(gap_of_inductance=shifted))
    falling = CURVES.inductance_of_gap._replace(low=550e-6, high=250e-6)
    with pytest.raises(LawRefusedError, match='rising order'):
        check_gap_curves(CURVES._replace(inductance_of_gap=falling))
