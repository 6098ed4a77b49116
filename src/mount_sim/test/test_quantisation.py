"""The compiled quantisation gives bit for bit what the codec gives."""

import math
import struct

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mount_driver.protocol import Measurement, MountCodec, Setpoint, Status
from mount_sim import quantisation

CODEC = MountCodec()
SAMPLE = Measurement(0, 0, 0.0, 0.0, 0.0, 0.0)


def measured(name):
    def through(value):
        return CODEC.measurement.decode(CODEC.encode_measurement(SAMPLE._replace(**{name: value}), 0))[1]

    return lambda value: getattr(through(value), name)


def setpoint(value):
    return CODEC.setpoint.decode(CODEC.encode_setpoint(Setpoint(value, 0), 0))[1].current


def temperature(value):
    return CODEC.status.decode(CODEC.encode_status(Status(14.0, value), 0))[1].coil_temperature_celsius


QUANTITIES = {
    **{name: (getattr(quantisation, f'quantised_{name}'), measured(name), -limit, limit)
       for name, limit in (
           ('displacement', 0.05), ('coil_current', 6.5), ('current_rate', 1e5), ('flux_rate', 1e4))},
    'setpoint': (quantisation.quantised_setpoint_current, setpoint, 0.0, 3.0),
    'coil_temperature': (quantisation.quantised_coil_temperature, temperature, -60.0, 250.0),
}  # fmt: skip
"""Function, way over the codec, and limits."""


@pytest.mark.parametrize('name', QUANTITIES)
def test_a_value_is_quantised_as_over_can_to_the_bit(name):
    quantised, over_can, low, high = QUANTITIES[name]

    @settings(max_examples=500, deadline=None)
    @given(st.floats(1.01 * low - 0.1, 1.01 * high) | st.floats(allow_nan=True, allow_infinity=True))
    @example(high)
    @example(low)
    @example(math.nextafter(high, math.inf))
    @example(math.nextafter(low, -math.inf))
    @example(-0.0)
    @example(-1e-12)
    def agrees(value):
        try:
            expected = over_can(value)
        except ValueError:
            expected = math.nan
        found = quantised(value)
        assert struct.pack('d', found) == struct.pack('d', expected) or (
            math.isnan(found) and math.isnan(expected)
        )

    agrees()
