"""Every fault of the actuator or its sensors ends in a refusal that says value, limit and remedy."""

import dataclasses

import numpy as np
import pytest

from mount_init.errors import (
    AmbiguousCurveError,
    ContradictionError,
    CurrentNotFollowingError,
    ImpreciseError,
    InitialisationError,
    NoContactError,
    OutsideCalibrationError,
    SpecimenMismatchError,
    TooFewRipplesError,
    UnusableReadingsError,
    WrongCoilError,
)
from mount_init.initialisation import OFF, Initialisation
from mount_init.parameters import InitParameters

SECOND_HALF = 1375  # sample number: the peak of the ramp


@pytest.fixture
def refusal(simulated_actuator, specimen, run_initialisation):
    """Return a function that gives the refusal of a faulty actuator."""

    def provoke(parameters=None, changed_specimen=None, **faults):
        with pytest.raises(InitialisationError) as raised:
            run_initialisation(simulated_actuator(**faults), changed_specimen or specimen, parameters)
        return raised.value

    return provoke


def inductance_times(factor):
    """Return a distortion that multiplies L_i by `factor(number, current)`."""

    def distort(number, sample):
        current, current_rate, flux_rate = sample
        return current, current_rate / factor(number, current), flux_rate

    return distort


def test_without_samples_nothing_is_estimated(specimen):
    initialisation = Initialisation(specimen, InitParameters())
    with pytest.raises(TooFewRipplesError, match='0 of 2750 ripple samples received; is mount_driver active'):
        initialisation.result()


def test_silence_is_told_with_the_number_of_samples(specimen, simulated_actuator):
    initialisation = Initialisation(specimen, InitParameters())
    for stamp in range(37):
        initialisation.step(stamp, *simulated_actuator().sample())
    sentence = str(initialisation.silence(1.0))
    assert sentence == (
        'air gap not estimated: 37 of 2750 ripple samples, none in the last 1.0 s; is mount_driver active?'
    )


def test_too_many_invalid_samples_are_refused(refusal):
    def distort(number, sample):
        return sample if number % 3 else (sample[0], np.nan, sample[2])

    error = refusal(distort=distort)
    assert isinstance(error, TooFewRipplesError)
    assert '167 of 250 ripple samples valid in the part "dwell before", needed are 200' in str(error)


def test_samples_that_stay_invalid_switch_the_coil_off_at_once(specimen, simulated_actuator, run_ramp):
    plant = simulated_actuator(distort=lambda number, s: s if number < 1000 else (np.nan, s[1], s[2]))
    initialisation = run_ramp(plant, specimen)
    assert plant.number == 1101
    assert plant.state[0] < 2.5  # on the way to 0 A
    assert initialisation.step(0, *plant.sample()) == OFF
    with pytest.raises(TooFewRipplesError, match='101 ripple samples in a row were invalid'):
        initialisation.result()


def test_an_open_coil_is_refused_early(specimen, simulated_actuator, run_ramp):
    plant = simulated_actuator(distort=lambda _, s: (0.0, s[1], s[2]))
    initialisation = run_ramp(plant, specimen)
    with pytest.raises(CurrentNotFollowingError, match=r'0\.000 A\) must follow .*is the coil connected'):
        initialisation.result()
    assert initialisation.readings.received < 100


@pytest.mark.parametrize('since', [200, 1000])
def test_a_current_that_followed_and_stays_away_is_refused(refusal, since):
    error = refusal(distort=lambda n, s: s if n < since else (0.0, s[1], s[2]))
    assert isinstance(error, CurrentNotFollowingError)
    assert 'it did before: did the coil come loose, or did setpoints come too late?' in str(error)
    assert 'is the coil connected' not in str(error)


def test_a_supply_too_weak_for_the_current_is_refused(refusal, specimen, simulated_actuator, run_ramp):
    error = refusal(supply=6.0)
    assert isinstance(error, CurrentNotFollowingError)
    assert 'coil current (2.400 A) must follow its setpoint (2.' in str(error)
    assert 'the supply at its voltage' in str(error)
    initialisation = run_ramp(simulated_actuator(supply=6.0), specimen)
    assert initialisation.step(0, 2.4, 1.0, 1.0) == OFF


def test_a_current_that_rises_alone_is_refused(refusal):
    error = refusal(distort=lambda _, s: (s[0] + 0.2, s[1], s[2]))
    assert isinstance(error, CurrentNotFollowingError)


def test_an_offset_of_the_rest_current_is_refused(refusal):
    error = refusal(distort=lambda _, s: (s[0] - 0.008, s[1], s[2]))
    assert isinstance(error, CurrentNotFollowingError)
    assert '(0.1920 A) must lie within 5.0 mA of 0.200 A' in str(error)


@pytest.mark.parametrize(
    ('reversed_slope', 'name'), [(1, 'slope of the coil current'), (2, 'slope of the flux density')]
)
def test_slopes_with_wrong_sign_are_refused(refusal, reversed_slope, name):
    def distort(_, sample):
        values = list(sample)
        values[reversed_slope] *= -1.0
        return tuple(values)

    error = refusal(distort=distort)
    assert isinstance(error, UnusableReadingsError)
    assert f'{name} after switching to plus must be positive; 2750 of 2750' in str(error)


@pytest.mark.parametrize(
    ('stuck', 'name'), [(1, 'slope of the coil current'), (2, 'slope of the flux density')]
)
@pytest.mark.parametrize('since', [0, 900])
def test_a_stuck_sensor_is_refused(refusal, stuck, name, since):
    last = []

    def distort(number, sample):
        if number < since or not last:
            last[:] = sample
        values = list(sample)
        values[stuck] = last[stuck]
        return tuple(values)

    error = refusal(distort=distort)
    assert isinstance(error, UnusableReadingsError)
    assert name in str(error)
    assert 'the sensor is stuck' in str(error)


def test_a_current_reading_that_is_stuck_at_rest_is_refused(refusal):
    error = refusal(distort=lambda n, s: s if n < 300 else (0.2, s[1], s[2]))
    assert isinstance(error, CurrentNotFollowingError)


def test_many_outliers_at_rest_are_refused(refusal):
    error = refusal(noise=0.01, distort=inductance_times(lambda n, _: 2.0 if n % 5 == 0 else 1.0))
    assert isinstance(error, UnusableReadingsError)
    assert '50 of 250 inductances at rest are outliers, more than 10%' in str(error)


def test_a_noisy_ripple_is_refused(refusal):
    error = refusal(noise=0.10)
    assert isinstance(error, AmbiguousCurveError)
    assert 'must fall steadily' in str(error)


def test_too_large_standard_deviations_are_refused(refusal):
    error = refusal(InitParameters(largest_rest_gap_std=1e-7), noise=0.01)
    assert isinstance(error, ImpreciseError)
    assert 'standard deviation of the rest gap (0.' in str(error)
    error = refusal(InitParameters(largest_contact_gap_std=1e-7), noise=0.01)
    assert isinstance(error, ImpreciseError)
    assert 'standard deviation of the contact gap (0.' in str(error)


def test_an_inductance_that_never_falls_low_enough_is_refused(refusal):
    def floor(_, sample):
        current, current_rate, flux_rate = sample
        return current, min(current_rate, 0.11808 * flux_rate / 21e-3 * (1 - 0.01 * current)), flux_rate

    error = refusal(distort=floor)
    assert isinstance(error, AmbiguousCurveError)
    assert 'must fall through 20.0 mH exactly once; it crosses nowhere (range 21.' in str(error)


def test_a_second_crossing_is_refused(refusal):
    error = refusal(distort=inductance_times(lambda _, i: 1.5 if 1.5 < i < 1.65 else 1.0))
    assert isinstance(error, AmbiguousCurveError)
    assert 'on the way up must fall through 20.0 mH exactly once' in str(error)
    assert '1.40 A, 1.50 A, 1.65 A' in str(error)


def test_a_curve_that_rises_beside_the_crossing_is_refused(refusal):
    error = refusal(distort=inductance_times(lambda _, i: 1.2 if 1.2 < i < 1.3 else 1.0))
    assert isinstance(error, AmbiguousCurveError)
    assert 'must fall steadily within 0.25 A of the crossing; from 1.18 to 1.23 A it rises' in str(error)


def test_a_crossing_that_differs_up_and_down_is_refused(refusal):
    error = refusal(distort=lambda n, s: s if n < SECOND_HALF else (1.015 * s[0], s[1], s[2]))
    assert isinstance(error, ContradictionError)
    assert 'on the way up and down (341.' in str(error)


def test_a_rest_gap_that_changes_during_the_ramp_is_refused(refusal):
    error = refusal(distort=inductance_times(lambda n, _: 1.0 if n < SECOND_HALF else 0.98))
    assert isinstance(error, ContradictionError)
    assert 'rest gap before and after the ramp (507.4 and 53' in str(error)


def test_a_rest_gap_beyond_the_calibration_is_refused(refusal):
    error = refusal(rest_gap=590e-6)
    assert isinstance(error, OutsideCalibrationError)
    assert 'rest gap not estimated' in str(error)
    assert 'rest inductance (40.663 mH) must lie within 41.404' in str(error)


@pytest.mark.parametrize('contact_um', [50, 100, 230])
def test_pads_that_are_worn_out_or_never_find_the_rod_are_refused(refusal, contact_um):
    error = refusal(contact_gap=contact_um * 1e-6)
    assert isinstance(error, OutsideCalibrationError)
    assert 'contact gap not estimated (pads worn out, or no rod?)' in str(error)


def test_a_contact_gap_whose_pressed_gap_leaves_the_law_is_refused(refusal):
    error = refusal(contact_gap=280e-6)
    assert isinstance(error, OutsideCalibrationError)
    assert str(error).startswith('current-force table: ')


@pytest.mark.parametrize('gap_um', [350, 400, 450, 500])
def test_pads_that_touch_at_rest_or_blocked_halves_are_refused(refusal, gap_um):
    error = refusal(contact_gap=(gap_um - 1) * 1e-6, rest_gap=gap_um * 1e-6)
    assert isinstance(error, NoContactError)
    assert 'must lie at least 8.0 um below the gap at 0.20 A' in str(error)


def test_a_contact_gap_above_the_rest_gap_is_refused(refusal, specimen):
    # 5 % too large a flux reading makes the halves look closed at rest, and open in contact
    wrong = dataclasses.replace(specimen, turns_area=1.05 * specimen.turns_area)
    error = refusal(changed_specimen=wrong, contact_gap=440e-6, rest_gap=480e-6)
    assert isinstance(error, NoContactError)


def test_a_contact_force_beyond_the_magnet_is_refused(refusal, specimen):
    stiff = dataclasses.replace(specimen, spring_stiffness=2e6)
    error = refusal(changed_specimen=stiff)
    assert isinstance(error, ContradictionError)
    assert 'spring force at the crossing (30' in str(error)
    assert 'must stay below the pull of the magnet (17' in str(error)


def test_a_magnet_too_weak_at_the_peak_is_refused(refusal):
    error = refusal(InitParameters(smallest_peak_force=350.0))
    assert isinstance(error, ContradictionError)
    assert 'normal force at 3.00 A (307.' in str(error)


def test_a_ramp_that_never_reaches_the_rest_current_is_refused(specimen):
    with pytest.raises(SpecimenMismatchError):
        Initialisation(dataclasses.replace(specimen, rest_current=3.0), InitParameters())


def test_a_peak_beyond_the_limit_of_the_coil_is_refused(specimen):
    with pytest.raises(SpecimenMismatchError, match=r'peak_current .* must not exceed .*\(2\.500 A\)'):
        Initialisation(dataclasses.replace(specimen, current_limit=2.5), InitParameters())


def test_after_the_end_only_zero_is_answered(specimen, simulated_actuator, run_ramp):
    plant = simulated_actuator()
    initialisation = run_ramp(plant, specimen)
    assert initialisation.finished
    assert initialisation.step(10**12, *plant.sample()) == OFF
    assert initialisation.last_stamp == 2750 * 1_000_000


def test_every_refusal_names_a_remedy(refusal):
    for error in (refusal(supply=6.0), refusal(rest_gap=590e-6), refusal(contact_gap=100e-6)):
        assert any(word in str(error) for word in ('check', 'is the coil', 'activate', 'calibrate'))


def test_ripple_at_another_rate_than_the_ramp_is_made_for_is_refused(specimen, simulated_actuator):
    plant, initialisation = simulated_actuator(), Initialisation(specimen, InitParameters())
    while not initialisation.finished:
        plant.follow(initialisation.step((plant.number + 1) * 500_000, *plant.sample()))
    with pytest.raises(UnusableReadingsError, match='at 2000 Hz, but sample_rate of mount_init is 1000 Hz'):
        initialisation.result()


def of_resistance(ohm):
    """Return a distortion that gives the flux the slope of a coil of `ohm` instead of 2.5 ohm."""

    def distort(number, sample):
        current, current_rate, flux_rate = sample
        share = (14.0 - ohm * current) / (14.0 - 2.5 * current)
        return current, current_rate * share, flux_rate * share

    return distort


def test_a_coil_with_shorted_turns_is_refused_with_value_limit_and_remedy(refusal):
    error = refusal(InitParameters(coil_temperature_celsius=20.0), distort=of_resistance(0.1))
    assert isinstance(error, WrongCoilError)
    assert str(error) == (
        'resistance of the coil (0.100 ohm, link voltage 14.0 V) must lie within 2.125 .. 2.875 ohm, that of '
        'default at 20 degC; are turns shorted? Check coil and cable, coil_temperature and the specimen'
    )


def test_a_coil_of_forty_per_cent_more_resistance_is_judged_by_its_temperature(
    refusal, simulated_actuator, specimen, run_initialisation
):
    error = refusal(InitParameters(coil_temperature_celsius=20.0), distort=of_resistance(3.5))
    assert 'is a contact loose, or the coil hotter than told?' in str(error)
    assert isinstance(refusal(InitParameters(), distort=of_resistance(4.7)), WrongCoilError)
    for celsius in (100.0, float('nan')):
        plant = simulated_actuator(distort=of_resistance(3.5))
        parameters = InitParameters(coil_temperature_celsius=celsius, smallest_travel=2e-6)
        result = run_initialisation(plant, dataclasses.replace(specimen, temperature=None), parameters)
        assert result.evidence.supply.whole.ohm == pytest.approx(3.5, abs=1e-6)
        assert result.evidence.supply.whole.link_voltage == pytest.approx(14.0, abs=1e-6)


def test_without_a_resistance_in_the_specimen_none_is_asked_for(
    simulated_actuator, specimen, run_initialisation
):
    unknown = dataclasses.replace(specimen, coil_resistance=None)
    result = run_initialisation(simulated_actuator(distort=of_resistance(0.1)), unknown)
    assert result.evidence.supply.whole.ohm == pytest.approx(0.1, abs=1e-6)
