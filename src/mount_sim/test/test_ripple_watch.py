"""The ripple is believed where coil and gap are what they were in the ramp, and doubted in time where not."""

import math

import numpy as np
import pytest

from mount_driver.watches.ripple_law import RippleLaw, ripple_law
from mount_driver.watches.ripple_watch import RippleWatch, RippleWatchParameters
from mount_models.coil.copper import CoilHeating
from mount_models.specimen import default_specimen
from mount_sim.plant.closing import ClosingMechanics, closed_state
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients, coil_at, current_rate, flux_rate
from mount_sim.quantisation import quantised_current_rate, quantised_flux_rate

MS = 1_000_000
ACTUATOR, COIL, MECHANICS = ReluctanceActuator(), RippleCoil(), ClosingMechanics()
STEP = np.linspace(0.0, 1.0, 1000)
UP = 0.2 + 2.8 * STEP**2 * (3.0 - 2.0 * STEP)
RISE = np.concatenate([np.linspace(0.0, 0.2, 50), np.full(300, 0.2), UP])
RAMP = np.concatenate([np.zeros(100), RISE, np.full(20, 3.0), RISE[::-1], np.zeros(30)])  # as mount_init's
DAMPING = 0.5 + 0.9 * np.abs(np.sin(50.0 * 1e-3 * np.arange(2000)))  # 8 Hz, 0.5 .. 1.4 A
READY = np.full(2000, 0.4935)


def supplied(celsius, volts):
    """Return the coil at this temperature (degC) and supply (V)."""
    return coil_at(COIL, TemperatureCoefficients(), celsius)._replace(link_voltage=volts)


def readings(currents, coil=COIL, mechanics=MECHANICS, actuator=ACTUATOR, noise=0.01, seed=1):
    """Return currents, di/dt and dB/dt, all (n,), as the simulated coil gives them over the bus."""
    random = np.random.default_rng(seed).normal(size=(2, len(currents))) * noise * math.sqrt(0.5)
    gap, rates, fluxes = mechanics.rest_gap, [], []
    for current, (one, other) in zip(currents, random.T, strict=True):
        gap, _ = closed_state(mechanics, actuator, current, gap)
        rates.append(quantised_current_rate(current_rate(coil, actuator, current, gap) * (1.0 + one)))
        fluxes.append(quantised_flux_rate(flux_rate(coil, actuator, current) * (1.0 + other)))
    return np.asarray(currents), np.array(rates), np.array(fluxes)


def watch(**limits):
    return RippleWatch(RippleWatchParameters(**limits), RippleLaw(), CoilHeating())


def fed(found, samples, volts=14.0, celsius=20.0, enabled=True, begin=0):
    """Return (sample, sentence) of the first doubt of the watch `found`, None if there is none."""
    found.take_status(volts, celsius)
    for k, (current, rate, flux) in enumerate(np.transpose(samples).tolist()):
        if sentence := found.judge(current, rate, flux, enabled, (begin + k) * MS):
            return k, sentence
    return None


@pytest.fixture
def learnt():
    """A watch that has seen the ramp at 20 degC and 14 V."""
    found = watch()
    assert fed(found, readings(RAMP)) is None
    return found


def test_the_defaults_are_the_shipped_specimen_s():
    law = ripple_law(default_specimen())
    for name, value in RippleLaw()._asdict().items():
        assert getattr(law, name) == pytest.approx(value, rel=1e-12), name


def test_the_ramp_tells_where_the_inductance_crosses_and_the_voltage(learnt):
    assert learnt._reference.crossing_current == pytest.approx(1.384, abs=0.014)
    assert learnt.voltage == pytest.approx(14.0, abs=0.1)


@pytest.mark.parametrize('currents', [DAMPING, READY, np.zeros(2000), 2.0 * DAMPING, np.full(2000, 3.0)])
@pytest.mark.parametrize('seed', [2, 3, 4])
def test_a_sound_coil_is_not_doubted(learnt, currents, seed):
    assert fed(learnt, readings(currents, seed=seed)) is None
    assert learnt.noise == pytest.approx(0.01, abs=0.005)


@pytest.mark.parametrize('before', [(-40.0, 14.0), (20.0, 9.0), (20.0, 16.0), (80.0, 14.0), (119.0, 12.0)])
@pytest.mark.parametrize('after', [(-40.0, 14.0), (20.0, 9.0), (20.0, 16.0), (80.0, 14.0), (122.0, 12.0)])
def test_no_temperature_and_no_supply_makes_a_sound_coil_look_faulty(before, after):
    found = watch()
    ramp, drive = RAMP, np.concatenate([DAMPING, READY])
    if before[1] < 12.0:
        ramp = np.minimum(RAMP, 2.6)  # what 9 V can drive so that the ripple is seen
    assert fed(found, readings(ramp, supplied(*before)), before[1], before[0]) is None
    assert not math.isnan(found.noise)
    assert fed(found, readings(drive, supplied(*after), seed=2), after[1], after[0]) is None


@pytest.mark.parametrize(
    ('currents', 'mechanics', 'within', 'places'),
    [
        (READY, {'contact_gap': 20e-6}, 310, '0.49 A'),
        (DAMPING, {'contact_gap': 20e-6}, 400, ''),
        (READY, {'spring_stiffness': 1e9}, 400, '0.49 A'),
        (DAMPING, {'spring_stiffness': 1e9}, 400, ''),
        (DAMPING, {'contact_gap': 200e-6}, 400, ''),
        (DAMPING, {'contact_gap': 300e-6}, 700, ''),
        (np.full(2000, 2.5), {'contact_gap': 20e-6}, 350, '2.50 A'),
    ],
)
def test_another_gap_is_found_while_damping(learnt, currents, mechanics, within, places):
    k, sentence = fed(learnt, readings(currents, mechanics=MECHANICS._replace(**mechanics)))
    assert k < within
    assert places in sentence
    assert 'that in the ramp of the initialisation' in sentence
    assert 'check pads and rod' in sentence


@pytest.mark.parametrize('currents', [np.zeros(2000), READY, DAMPING])
def test_shorted_turns_are_found_by_the_voltage(learnt, currents):
    shorted = readings(currents, COIL._replace(resistance=1.25), actuator=ACTUATOR._replace(turns=240.0))
    k, sentence = fed(learnt, shorted)
    assert 300 <= k <= 320
    assert 'must lie within 15 % of the supply (14.0 V)' in sentence
    assert 'shorted turns' in sentence


def changed(samples, rate=1.0, flux=1.0):
    return samples[0], samples[1] * rate, samples[2] * flux


@pytest.mark.parametrize('currents', [np.zeros(2000), READY, DAMPING])
@pytest.mark.parametrize('rate', [1.3, 1.0 / 1.3])
def test_a_wrong_scale_is_found(learnt, currents, rate):
    k, sentence = fed(learnt, changed(readings(currents), rate=rate))
    assert 300 <= k < 400
    assert 'ripple measurement' in sentence
    k, sentence = fed(watch(), changed(readings(currents), flux=rate))
    assert k < 330
    assert 'of the supply' in sentence


def test_a_ripple_that_is_missing_is_found_also_if_a_reading_comes_now_and_then(learnt):
    samples = changed(readings(READY), rate=math.nan)
    k, sentence = fed(learnt, samples)
    assert 300 <= k <= 320
    assert 'not valid for 0.3 s' in sentence
    samples[1][::5] = readings(READY)[1][::5]
    found = watch()
    assert fed(found, readings(RAMP)) is None
    assert fed(found, samples) is not None


def test_noise_is_told_as_noise(learnt):
    k, sentence = fed(learnt, readings(READY, noise=0.2))
    assert k < 400
    assert 'scatters by' in sentence
    assert 'limit 5 %' in sentence


@pytest.mark.parametrize(('every', 'factor'), [(40, 3.0), (3, math.nan)])
def test_readings_that_are_wild_or_missing_now_and_then_are_no_fault(learnt, every, factor):
    samples = readings(DAMPING)
    samples[1][::every] *= factor
    assert fed(learnt, samples) is None


def test_a_deviation_that_goes_is_no_fault(learnt):
    missing = MECHANICS._replace(contact_gap=20e-6)
    for begin in range(10_000, 20_000, 1000):
        assert fed(learnt, readings(READY[:200], mechanics=missing), begin=begin) is None
        assert fed(learnt, readings(READY[:100]), begin=begin + 200) is None


def test_pauses_of_the_bridge_hide_no_fault(learnt):
    bad = changed(readings(READY[:100]), rate=math.nan)
    found = [
        fed(learnt, bad, enabled=enabled, begin=10_000 + 200 * k + 100 * (not enabled))
        for k in range(5)
        for enabled in (True, False)
    ]
    assert [k for k, doubt in enumerate(found) if doubt] == [6, 8]


def test_an_unknown_supply_is_no_fault_and_the_gap_is_watched_on(learnt):
    assert fed(learnt, readings(DAMPING), math.nan, math.nan) is None
    assert (
        fed(learnt, readings(DAMPING, mechanics=MECHANICS._replace(contact_gap=20e-6)), math.nan) is not None
    )


def test_what_ends_before_its_peak_is_no_ramp(learnt):
    found = watch()
    half = np.concatenate([np.linspace(0.0, 1.5, 500), np.linspace(1.5, 0.0, 500)])
    assert fed(found, readings(half, mechanics=MECHANICS._replace(contact_gap=200e-6))) is None
    assert math.isnan(found.noise)
    jump = np.array([0.0] * 50 + [2.5] * 50 + [0.0] * 50)  # a sweep with holes
    assert fed(found, readings(jump)) is None
    assert math.isnan(found.noise)
    assert fed(found, readings(RAMP)) is None
    assert found._reference.crossing_current == pytest.approx(learnt._reference.crossing_current, abs=0.012)


@pytest.mark.parametrize(
    ('mechanics', 'rate', 'words'),
    [
        ({'contact_gap': 150e-6}, 1.0, 'falls through 20 mH at'),
        ({'rest_gap': 620e-6, 'contact_gap': 400e-6}, 1.0, 'mH at 0.2 A'),
        ({}, 1.3, 'mH'),
    ],
)
def test_a_ramp_of_another_actuator_is_refused(mechanics, rate, words):
    samples = changed(readings(RAMP, mechanics=MECHANICS._replace(**mechanics)), rate=rate)
    k, sentence = fed(watch(), samples)
    assert RAMP[k] < 0.05
    assert k > 2000
    assert sentence.startswith('coil ripple in the ramp')
    assert words in sentence
    assert 'check' in sentence


def test_a_frozen_ripple_is_found_once_the_current_moves(learnt):
    still, moving = readings(READY), readings(DAMPING)
    frozen = still[1][-1], still[2][-1]
    for samples, found in ((still, False), (moving, True)):
        samples[1][:], samples[2][:] = frozen
        assert (fed(learnt, samples, begin=10_000 * (1 + found)) is not None) is found


ONCE = np.concatenate([READY, 0.5 + 0.6 * np.sin(np.linspace(0.0, 2.0 * np.pi, 125)) ** 2, READY])
"""Damped for one period of 8 Hz, up to 1.1 A; above 0.75 A for some 70 samples."""


@pytest.mark.parametrize('volts', [9.0, 14.0, 16.0])
def test_pads_that_wear_are_found_where_the_engine_is_damped_for_one_period_alone(volts):
    found = watch()
    assert fed(found, readings(RAMP, supplied(20.0, volts)), volts) is None
    begin, worn = len(RAMP), MECHANICS._replace(contact_gap=260e-6)
    assert fed(found, readings(ONCE, supplied(20.0, volts)), volts, begin=begin) is None
    doubt = fed(found, readings(ONCE, supplied(20.0, volts), worn), volts, begin=begin + len(ONCE))
    assert doubt is not None
    assert len(READY) + 300 <= doubt[0] < len(READY) + 350
    assert doubt[1].startswith('coil inductance by the ripple at ')
