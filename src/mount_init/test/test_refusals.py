"""Every fault of the actuator or its sensors ends in a refusal that says value, limit and remedy."""

import dataclasses
import math

import numpy as np
import pytest
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation, run_ramp

from mount_init.errors import InitialisationError
from mount_init.initialisation import OFF, Initialisation
from mount_init.parameters import InitParameters

HALF = 1375  # sample number: the peak of the ramp


@pytest.fixture
def refusal():
    """Return a function that gives the refusal of a faulty actuator."""

    def provoke(parameters=None, changes=None, **faults):
        changed = dataclasses.replace(SPECIMEN, **(changes or {}))
        with pytest.raises(InitialisationError) as raised:
            run_initialisation(SimulatedActuator(**faults), changed, InitParameters(**(parameters or {})))
        return str(raised.value)

    return provoke


def inductance_times(factor):
    """Return a distortion that multiplies L_i by `factor(number, current)`."""
    return lambda number, s: (s[0], s[1] / factor(number, s[0]), s[2])


def current_from(since, change):
    """Return a distortion of the current reading from a sample number on."""
    return lambda number, s: s if number < since else (change(s[0]), s[1], s[2])


def stuck(reading, since):
    last = []

    def distort(number, sample):
        if number < since or not last:
            last[:] = sample
        return tuple(last[k] if k == reading else value for k, value in enumerate(sample))

    return distort


def of_resistance(ohm):
    """Return a distortion that gives the flux the slope of a coil of `ohm` instead of 2.5 ohm."""

    def distort(_, sample):
        share = (14.0 - ohm * sample[0]) / (14.0 - 2.5 * sample[0])
        return sample[0], sample[1] * share, sample[2] * share

    return distort


def never_low(_, sample):
    current, current_rate, flux_rate = sample
    return current, min(current_rate, 0.11808 * flux_rate / 21e-3 * (1 - 0.01 * current)), flux_rate


DI, DB = 'slope of the coil current', 'slope of the flux density'
REVERSED = 'after switching to plus must be positive; 2750 of 2750'
GONE = 'it did before: did the coil come loose, or did setpoints come too late?'
WORN = 'contact gap not estimated (pads worn out, or no rod?)'
OUTSIDE = 'current-force table: '
TOUCHING = 'must lie at least 8.0 um below the gap at 0.20 A'
AT_20 = {'coil_temperature_celsius': 20.0}
FAULTS = {
    'invalid samples': (
        {'distort': lambda n, s: s if n % 3 else (s[0], np.nan, s[2])},
        '167 of 250 ripple samples valid in the part "dwell before", needed are 200',
    ),
    'lost coil at rest': ({'distort': current_from(200, lambda _: 0.0)}, GONE),
    'lost coil in the ramp': ({'distort': current_from(1000, lambda _: 0.0)}, GONE),
    'weak supply': ({'supply': 6.0}, 'coil current (2.400 A) must follow its setpoint (2.'),
    'current rises alone': ({'distort': current_from(0, lambda i: i + 0.2)}, 'must follow its setpoint'),
    'stuck current': ({'distort': current_from(300, lambda _: 0.2)}, 'must follow its setpoint'),
    'offset': (
        {'distort': current_from(0, lambda i: i - 0.008)},
        '(0.1920 A) must lie within 5.0 mA of 0.200 A',
    ),
    'reversed di/dt': ({'distort': lambda _, s: (s[0], -s[1], s[2])}, f'{DI} {REVERSED}'),
    'reversed dB/dt': ({'distort': lambda _, s: (s[0], s[1], -s[2])}, f'{DB} {REVERSED}'),
    'stuck di/dt': ({'distort': stuck(1, 900)}, f'{DI} stayed at'),
    'stuck dB/dt': ({'distort': stuck(2, 0)}, f'{DB} stayed at'),
    'dB/dt stuck in the ramp': ({'distort': stuck(2, 900)}, f'{DB} stayed at'),
    'outliers': (
        {'noise': 0.01, 'distort': inductance_times(lambda n, _: 2.0 if n % 5 == 0 else 1.0)},
        '50 of 250 inductances at rest are outliers, more than 10%',
    ),
    'noise': ({'noise': 0.10}, 'must fall steadily'),
    'scatter at rest': (
        {'noise': 0.01, 'parameters': {'largest_rest_gap_std': 1e-7}},
        'standard deviation of the rest gap (0.',
    ),
    'scatter in contact': (
        {'noise': 0.01, 'parameters': {'largest_contact_gap_std': 1e-7}},
        'standard deviation of the contact gap (0.',
    ),
    'no crossing': (
        {'distort': never_low},
        'must fall through 20.0 mH exactly once; it crosses nowhere (range 21.',
    ),
    'second crossing': (
        {'distort': inductance_times(lambda _, i: 1.5 if 1.5 < i < 1.65 else 1.0)},
        'on the way up must fall through 20.0 mH exactly once; it crosses 1.40 A, 1.50 A, 1.65 A',
    ),
    'rise beside the crossing': (
        {'distort': inductance_times(lambda _, i: 1.2 if 1.2 < i < 1.3 else 1.0)},
        'must fall steadily within 0.25 A of the crossing; from 1.18 to 1.23 A it rises',
    ),
    'crossing up and down': (
        {'distort': current_from(HALF, lambda i: 1.015 * i)},
        'on the way up and down (341.',
    ),
    'moving rest gap': (
        {'distort': inductance_times(lambda n, _: 1.0 if n < HALF else 0.98)},
        'rest gap before and after the ramp (507.4 and 53',
    ),
    'rest gap outside': (
        {'rest_gap': 590e-6},
        'rest gap not estimated (are the halves mounted as calibrated?): rest inductance (40.663 mH) must '
        'lie within 41.404',
    ),
    'no rod': ({'contact_gap': 50e-6}, WORN),
    'worn pads': ({'contact_gap': 230e-6}, WORN),
    'pressed gap outside': ({'contact_gap': 280e-6}, OUTSIDE),
    'pads touch at rest': ({'contact_gap': 349e-6, 'rest_gap': 350e-6}, TOUCHING),
    'blocked halves': ({'contact_gap': 499e-6, 'rest_gap': 500e-6}, TOUCHING),
    # 5 % too large a flux reading makes the halves look closed at rest, and open in contact
    'contact above rest': (
        {'contact_gap': 440e-6, 'rest_gap': 480e-6, 'changes': {'turns_area': 1.05 * 0.11808}},
        TOUCHING,
    ),
    'stiff springs': (
        {'changes': {'spring_stiffness': 2e6}},
        'must stay below the pull of the magnet (17',
    ),
    'weak magnet': ({'parameters': {'smallest_peak_force': 350.0}}, 'normal force at 3.00 A (307.'),
    'shorted turns': (
        {'parameters': AT_20, 'distort': of_resistance(0.1)},
        'resistance of the coil (0.100 ohm, link voltage 14.0 V) must lie within 2.125 .. 2.875 ohm, that of '
        'default at 20 degC; are turns shorted? Check coil and cable, coil_temperature and the specimen',
    ),
    'loose contact': (
        {'parameters': AT_20, 'distort': of_resistance(3.5)},
        'is a contact loose, or the coil hotter than told?',
    ),
    'hotter than any coil': ({'distort': of_resistance(4.7)}, 'resistance of the coil (4.700 ohm'),
}


@pytest.mark.parametrize(('fault', 'sentence'), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_refused_with_value_limit_and_remedy(refusal, fault, sentence):
    refused = refusal(**fault)
    assert sentence in refused
    remedies = 'check', 'is the coil', 'did the coil', 'activate', 'calibrate'
    assert sentence in (WORN, OUTSIDE) or any(word in refused.lower() for word in remedies)


@pytest.mark.parametrize(
    ('since', 'reading', 'ends', 'sentence'),
    [
        (1000, math.nan, 1101, '101 ripple samples in a row were invalid'),
        (0, 0.0, 56, r'0\.000 A\) must follow .*is the coil connected'),
        (1000, 0.0, 1021, r'must follow its setpoint .* did setpoints come too late'),
        (9999, 0.0, 2750, None),
    ],
)
def test_a_ramp_that_cannot_go_on_ends_at_once_and_from_its_end_on_only_zero_is_answered(
    since, reading, ends, sentence
):
    plant = SimulatedActuator(distort=current_from(since, lambda _: reading))
    initialisation = run_ramp(plant)
    assert plant.number == initialisation.stamps[-1] // 1_000_000 == ends
    assert initialisation.step(10**12, 2.4, 1.0, 1.0) == OFF
    if sentence:
        with pytest.raises(InitialisationError, match=sentence):
            initialisation.result()


def test_a_ramp_that_has_not_ended_has_no_result():
    with pytest.raises(
        InitialisationError, match='0 of 2750 ripple samples received; is mount_driver active'
    ):
        Initialisation(SPECIMEN, InitParameters()).result()


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        ({'rest_current': 3.0}, r'rest current .* must lie between 0 A and peak_current'),
        ({'current_limit': 2.5}, r'peak_current .* must not exceed .*\(2\.500 A\)'),
    ],
)
def test_a_specimen_that_does_not_fit_the_ramp_is_refused(changes, sentence):
    with pytest.raises(InitialisationError, match=sentence):
        Initialisation(dataclasses.replace(SPECIMEN, **changes), InitParameters())


def test_ripple_at_another_rate_than_the_ramp_is_made_for_is_refused():
    plant, initialisation = SimulatedActuator(), Initialisation(SPECIMEN, InitParameters())
    while not initialisation.finished:
        plant.follow(initialisation.step((plant.number + 1) * 500_000, *plant.sample()))
    with pytest.raises(InitialisationError, match='at 2000 Hz, but sample_rate of mount_init is 1000 Hz'):
        initialisation.result()


@pytest.mark.parametrize(
    ('ohm', 'celsius', 'changes'),
    [
        (3.5, 100.0, {'temperature': None}),
        (3.5, math.nan, {'temperature': None}),
        (0.1, math.nan, {'coil_resistance': None}),
    ],
)
def test_a_resistance_that_the_temperature_explains_or_nobody_knows_is_granted(ohm, celsius, changes):
    parameters = InitParameters(coil_temperature_celsius=celsius, smallest_travel=2e-6)
    plant = SimulatedActuator(distort=of_resistance(ohm))
    result = run_initialisation(plant, dataclasses.replace(SPECIMEN, **changes), parameters)
    assert result.evidence.supply.whole.ohm == pytest.approx(ohm, abs=1e-6)
    assert result.evidence.supply.whole.link_voltage == pytest.approx(14.0, abs=1e-6)
