"""Which coil temperature an initialisation is compensated for, and what it says without one."""

import math
from dataclasses import replace

import pytest
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation

from mount_init.errors import InitialisationError
from mount_init.estimate import TemperatureReadings, coil_temperature
from mount_init.node import verdict
from mount_init.parameters import InitParameters
from mount_ros.nodes.diagnostics import Level

SECOND = 1_000_000_000  # ns
PARAMETERS = InitParameters(peak_current=2.5)


def readings(*pairs):
    made = TemperatureReadings()
    for time, celsius in pairs:
        made.take(round(time * SECOND), celsius)
    return made


@pytest.mark.parametrize(
    ('pairs', 'time', 'expected'),
    [
        (((1.0, 30.0), (1.1, 31.0), (1.2, 32.0)), 1.15, 31.0),  # the newest up to then
        (((1.0, 30.0), (1.1, 31.0), (1.2, 32.0)), 1.2, 32.0),
        (((1.0, 30.0),), 0.9, math.nan),
        (((1.0, 30.0), (1.1, math.nan)), 1.2, 30.0),  # NaN is no reading
        (tuple((0.1 * k, 20.0 + 0.1 * k) for k in range(340)), 17.0, 37.0),  # 10 Hz over the longest ramp
        (((1.0, 30.0),), 6.0, 30.0),
        (((1.0, 30.0),), 6.001, math.nan),  # too old
        (((7.0, 60.0), (9.0, 61.0), (8.0, 20.0)), 7.5, math.nan),  # the time started anew
        (((7.0, 60.0), (9.0, 61.0), (8.0, 20.0)), 9.0, 20.0),
    ],
)
def test_the_newest_reading_up_to_then_counts(pairs, time, expected):
    assert readings(*pairs).at(round(time * SECOND)) == pytest.approx(expected, nan_ok=True)


def test_what_is_measured_comes_before_what_is_given_and_that_before_nothing():
    made = readings((1.0, 30.0))
    assert coil_temperature(made, SECOND, 50.0) == (30.0, 'measured')
    assert coil_temperature(made, 0, 50.0) == (50.0, 'parameter')
    unknown = coil_temperature(made, 0, math.nan)
    assert math.isnan(unknown.celsius)
    assert unknown.source == 'unknown'


def test_the_measured_temperature_compensates_as_a_given_one_does_to_the_bit():
    # the ramp begins at 1 ms; what comes behind its middle does not count any more
    made = readings((0.0, 20.0), (1.3, 60.0), (1.4, 100.0))
    measured = run_initialisation(SimulatedActuator(celsius=60.0), SPECIMEN, PARAMETERS, made)
    given = PARAMETERS._replace(coil_temperature_celsius=60.0)
    expected = run_initialisation(SimulatedActuator(celsius=60.0), SPECIMEN, given)
    assert (measured.rest_gap, measured.contact_gap) == (expected.rest_gap, expected.contact_gap)
    assert measured.evidence.temperature == (60.0, 'measured')
    said = verdict(measured, SPECIMEN)
    assert said.level == Level.OK
    assert said.figures['coil_temperature_celsius'] == '60.0'
    assert said.figures['coil_temperature_from'] == 'measured'


def test_an_unknown_temperature_is_taken_for_that_of_the_calibration_with_a_warning():
    result = run_initialisation(SimulatedActuator(celsius=60.0), SPECIMEN, PARAMETERS)
    calibrated = PARAMETERS._replace(coil_temperature_celsius=SPECIMEN.temperature.calibration_celsius)
    of_any_resistance = replace(SPECIMEN, coil_resistance=None)  # else one told so cold would be refused
    expected = run_initialisation(SimulatedActuator(celsius=60.0), of_any_resistance, calibrated)
    assert (result.rest_gap, result.contact_gap) == (expected.rest_gap, expected.contact_gap)
    assert abs(result.rest_gap - 508e-6) > 20e-6  # what the warning is for
    said = verdict(result, SPECIMEN)
    assert said.level == Level.WARN
    assert said.sentence.startswith('rest gap ')
    assert 'not compensated for the coil temperature, which is unknown: right at 20 degC' in said.sentence
    assert 'coil_temperature_celsius' in said.sentence
    assert said.figures['coil_temperature_from'] == 'unknown'


def test_a_specimen_without_compensation_asks_for_no_temperature():
    plain = replace(SPECIMEN, temperature=None)
    assert verdict(run_initialisation(SimulatedActuator(), plain, PARAMETERS), plain).level == Level.OK


def test_a_measured_temperature_beyond_the_compensation_is_refused():
    with pytest.raises(InitialisationError, match=r'coil temperature \(150\.0 degC\)'):
        run_initialisation(SimulatedActuator(), SPECIMEN, PARAMETERS, readings((0.0, 150.0)))
