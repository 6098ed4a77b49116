"""The coil warms by its own current as a body of first order, and derating keeps it below its limit."""

import math

import pytest

from mount_models.coil.copper import CoilHeating, check_heating, highest_current, warmed
from mount_models.plain_yaml import yaml_in_file
from mount_models.quantity import ParameterError
from mount_models.specimen import DEFAULT_SPECIMEN, default_specimen, specimen_from_mapping

HEATING = CoilHeating()


def after(heating, celsius, current, duration, step=0.1):
    for _ in range(round(duration / step)):
        celsius = warmed(heating, celsius, current * current, step)
    return celsius


def test_without_current_the_coil_cools_to_the_ambient_by_the_time_constant():
    celsius = after(HEATING, 180.0, 0.0, HEATING.time_constant)
    assert celsius == pytest.approx(80.0 + 100.0 / math.e, abs=0.01)


@pytest.mark.parametrize('current', [0.5, 1.0, 1.5])
def test_it_warms_to_where_loss_and_cooling_are_equal(current):
    h = HEATING
    warmth = h.thermal_resistance * h.resistance * current**2
    steady = (h.ambient_celsius + warmth * (1.0 - 20.0 * h.copper)) / (1.0 - warmth * h.copper)
    assert after(h, h.ambient_celsius, current, 20 * h.time_constant) == pytest.approx(steady, abs=1e-4)


def test_the_bits_are_the_same_on_every_processor():
    assert after(HEATING, 80.0, 3.0, 100.0).hex() == '0x1.aaf8159b083f6p+6'
    assert highest_current(HEATING, 151.1, 3.0).hex() == '0x1.e3d70a3d70a40p+0'


def test_the_current_falls_in_a_straight_line_between_derating_and_limit():
    assert [highest_current(HEATING, celsius, 3.0) for celsius in (-40.0, 140.0, 155.0, 170.0, 300.0)] == [
        3.0,
        3.0,
        1.5,
        0.0,
        0.0,
    ]


@pytest.mark.parametrize('ambient', [20.0, 80.0, 130.0])
def test_a_coil_that_only_its_current_heats_never_reaches_its_limit(ambient):
    heating = HEATING._replace(ambient_celsius=ambient)
    celsius, hottest = ambient, ambient
    for _ in range(100_000):
        celsius = warmed(heating, celsius, highest_current(heating, celsius, 3.0) ** 2, 0.1)
        hottest = max(hottest, celsius)
    assert heating.derating_celsius < hottest < heating.limit_celsius


@pytest.mark.parametrize('changes', [{'ambient_celsius': 140.0}, {'limit_celsius': 140.0}])
def test_temperatures_out_of_order_are_refused(changes):
    with pytest.raises(ParameterError, match='must rise in this order'):
        check_heating(HEATING._replace(**changes))


def test_the_shipped_specimen_has_the_defaults_and_a_file_without_them_too():
    assert default_specimen().heating == HEATING
    content = yaml_in_file(DEFAULT_SPECIMEN)
    del content['heating']
    assert specimen_from_mapping(content).heating == HEATING
