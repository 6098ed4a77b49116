"""The ripple's inductance at another duty than that of the calibration, against the simulated truth."""

import math

import numpy as np
import pytest

from mount_models.coil.copper import resistance_beside_drift
from mount_models.coil.correction import (
    Bridge,
    at_calibrated_duty,
    duty,
    gap_reluctance,
    skin_ratio,
    skin_shape,
)
from mount_models.specimen import default_specimen
from mount_sim.plant.reluctance import ReluctanceActuator, gap_permeance
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

TRUTH = ReluctanceActuator()
SPECIMEN = default_specimen()


def reluctance(gap):
    return gap_reluctance(SPECIMEN.bridge, SPECIMEN.gap_curves, SPECIMEN.temperature, 2.5, 0.2, gap)


@pytest.mark.parametrize('gap', [250e-6, 349e-6, 492e-6, 550e-6])
def test_the_share_of_the_gap_follows_from_the_calibration_at_two_temperatures(gap):
    truth = 1.0 / (TRUTH.turns**2 * gap_permeance(TRUTH, gap))
    assert reluctance(gap) == pytest.approx(truth, rel=3e-3)


@pytest.mark.parametrize('volts', [9.0, 12.0, 16.0])
@pytest.mark.parametrize(('current', 'gap'), [(0.2, 492e-6), (1.2, 250e-6), (1.38, 341e-6), (1.6, 450e-6)])
def test_an_inductance_at_another_supply_is_carried_to_that_of_the_curves(volts, current, gap):
    there = incremental_inductance(RippleCoil(link_voltage=volts), TRUTH, current, gap)
    at_curves = incremental_inductance(RippleCoil(), TRUTH, current, gap)
    ratio = skin_ratio(SPECIMEN.bridge, duty(2.5, current, volts), duty(2.5, current, 14.0))
    carried = at_calibrated_duty(there, reluctance(gap), ratio)
    assert carried == pytest.approx(at_curves, rel=3e-4)
    assert abs(carried - at_curves) < 0.1 * abs(there - at_curves) + 1e-7


def test_at_the_duty_of_the_curves_an_inductance_stays_as_it_is_to_the_bit():
    inductance = np.linspace(5e-3, 60e-3, 100)
    ratio = skin_ratio(Bridge(), duty(2.5, 1.0, 14.0), duty(2.5, 1.0, 14.0))
    np.testing.assert_array_equal(at_calibrated_duty(inductance, 10.0, ratio), inductance)


def test_a_duty_that_no_bridge_has_is_not_a_number():
    assert np.isnan(skin_shape(Bridge(), [0.0, 1.0, 1.1, math.nan])).all()
    assert np.isfinite(skin_shape(Bridge(), [0.1, 0.5, 0.9])).all()


def test_a_resistance_is_found_beside_a_voltage_that_drifts():
    time = np.linspace(0.0, 1.0, 1000)
    current = 0.2 + 2.8 * time * time * (3.0 - 2.0 * time)
    volts = 12.0 + 2.5 * time - 2.5 * current
    found = resistance_beside_drift(0.1, current, volts / 0.1)
    assert found.ohm == pytest.approx(2.5, abs=1e-9)
    assert found.misfit < 1e-9
    volts[600:] += 1.0
    assert resistance_beside_drift(0.1, current, volts / 0.1).misfit > 0.1
