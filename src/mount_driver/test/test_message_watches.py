"""Each bit and value of the status has its reaction; what is within its limits has none."""

import math
import re

import pytest

from mount_driver.protocol import Status
from mount_driver.watches.message_watches import StatusLimits, StatusWatch

MS = 1_000_000
SOUND = Status(14.0, 60.0)


def watch():
    return StatusWatch(StatusLimits())


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        (
            {'over_current': True},
            r'report over_current \(is 1, must be 0; 60\.0 degC, 14\.00 V\): check coil, cable',
        ),
        ({'over_temperature': True}, r'report over_temperature \(.*\): let the coil cool'),
        ({'under_voltage': True}, r'report under_voltage \(.*\): check battery'),
        ({'supply_voltage': 8.99}, r'supply voltage \(8\.99 V\) must lie within 9 \.\. 16 V: check'),
        ({'supply_voltage': 16.01}, r'supply voltage \(16\.01 V\)'),
        ({'coil_temperature_celsius': 180.1}, r'\(180\.1 degC\) must not exceed 180 degC: let'),
    ],
)
def test_what_takes_the_coil_off_says_value_limit_and_remedy(changes, sentence):
    assert re.search(sentence, watch().judge(SOUND._replace(**changes), 0))


@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'supply_voltage': 9.0},
        {'supply_voltage': 16.0},
        {'coil_temperature_celsius': 180.0},
        {'supply_voltage': math.nan, 'coil_temperature_celsius': math.nan},  # not available
        {'setpoint_timeout': True, 'e2e_error': True},
    ],
)
def test_what_lies_within_the_limits_changes_nothing(changes):
    health = watch()
    assert health.judge(SOUND._replace(**changes), 0) == ''
    assert health.hold(0) == ''


def test_a_displacement_sensor_at_fault_keeps_0_ampere_for_as_long_as_it_is():
    health = watch()
    assert health.judge(SOUND._replace(displacement_sensor=True), 0) == ''
    assert 'displacement_sensor is 1, must be 0): check the sensor' in health.hold(99 * MS)
    health.judge(SOUND, 100 * MS)
    assert health.hold(101 * MS) == ''


@pytest.mark.parametrize('first', [None, SOUND])
def test_without_a_status_the_coil_stays_at_0_ampere_from_1_s_on_until_one_comes(first):
    health = watch()
    if first is not None:
        health.judge(first, 0)
    assert health.hold(0) == health.hold(1000 * MS) == ''
    assert health.hold(1001 * MS).startswith('no status of the electronics for more than 1 s: supply and')
    health.judge(SOUND, 1100 * MS)
    assert health.hold(1101 * MS) == ''
