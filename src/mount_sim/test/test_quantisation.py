"""The compiled quantisation gives bit for bit what the codec gives."""

import math
import struct

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mount_driver.protocol import Measurement, MountCodec, Setpoint, Status
from mount_models.quantity import ParameterError
from mount_models.sampling import HIGHEST_CURRENT
from mount_sim import quantisation

CODEC = MountCodec()
SAMPLE = Measurement(0, 0, 0.0, 0.0, 0.0, 0.0)
QUANTITIES = {
    'displacement': (quantisation.quantised_displacement, 0.05),
    'coil_current': (quantisation.quantised_coil_current, 6.5),
    'current_rate': (quantisation.quantised_current_rate, 1e5),
    'flux_rate': (quantisation.quantised_flux_rate, 1e4),
}
anything = st.floats(allow_nan=True, allow_infinity=True)


def over_can(name, value):
    """Return what comes out of the codec; NaN where it refuses."""
    try:
        data = CODEC.encode_measurement(SAMPLE._replace(**{name: value}), 0)
    except ParameterError:
        return math.nan
    return getattr(CODEC.measurement.decode(data)[1], name)


def same_bits(left, right):
    return struct.pack('d', left) == struct.pack('d', right) or (math.isnan(left) and math.isnan(right))


@pytest.mark.parametrize('name', QUANTITIES)
def test_a_reading_is_quantised_as_over_can(name):
    quantised, limit = QUANTITIES[name]

    @settings(max_examples=500, deadline=None)
    @given(st.floats(-1.01 * limit, 1.01 * limit) | anything)
    @example(limit)
    @example(-limit)
    @example(math.nextafter(limit, math.inf))
    @example(-0.0)
    @example(-1e-12)
    def agrees(value):
        assert same_bits(quantised(value), over_can(name, value))

    agrees()


@settings(max_examples=500, deadline=None)
@given(st.floats(-0.1, 3.1) | anything)
@example(-0.0)
@example(3.0)
def test_a_setpoint_is_quantised_as_over_can(value):
    try:
        expected = CODEC.setpoint.decode(CODEC.encode_setpoint(Setpoint(value, 0), 0))[1].current
    except ParameterError:
        expected = math.nan
    assert same_bits(quantisation.quantised_setpoint_current(value), expected)


@settings(max_examples=500, deadline=None)
@given(st.floats(-61.0, 251.0) | anything)
@example(-60.0)
@example(250.0)
@example(-0.01)
@example(math.nextafter(250.0, math.inf))
def test_a_coil_temperature_is_quantised_as_over_can(value):
    try:
        expected = CODEC.status.decode(CODEC.encode_status(Status(14.0, value), 0))[
            1
        ].coil_temperature_celsius
    except ParameterError:
        expected = math.nan
    assert same_bits(quantisation.quantised_coil_temperature(value), expected)


@settings(max_examples=200, deadline=None)
@given(st.floats(-0.05, 0.05))
def test_quantising_twice_changes_nothing(value):
    once = quantisation.quantised_displacement(value)
    assert same_bits(quantisation.quantised_displacement(once), once)
    assert abs(once - value) <= 0.500001e-7


@pytest.mark.parametrize(
    ('scaling', 'steps', 'limit'),
    [
        (CODEC.displacement, quantisation.DISPLACEMENT_STEPS, quantisation.DISPLACEMENT_LIMIT),
        (CODEC.coil_current, quantisation.COIL_CURRENT_STEPS, quantisation.COIL_CURRENT_LIMIT),
        (CODEC.current_rate, quantisation.CURRENT_RATE_STEPS, quantisation.CURRENT_RATE_LIMIT),
        (CODEC.flux_rate, quantisation.FLUX_RATE_STEPS, quantisation.FLUX_RATE_LIMIT),
    ],
)
def test_steps_and_limits_are_those_of_the_dbc(scaling, steps, limit):
    assert (scaling.steps, scaling.raw_low, scaling.raw_high) == (steps, -limit, limit)


def test_step_and_limits_of_the_coil_temperature_are_those_of_the_dbc():
    assert CODEC.coil_temperature.steps == quantisation.COIL_TEMPERATURE_STEPS
    assert CODEC.coil_temperature.raw_low == quantisation.COIL_TEMPERATURE_LOWEST
    assert CODEC.coil_temperature.raw_high == quantisation.COIL_TEMPERATURE_HIGHEST


def test_the_setpoint_limits_are_those_of_the_dbc():
    assert CODEC.current.steps == quantisation.SETPOINT_STEPS
    assert (CODEC.current.low, CODEC.current.high) == (0.0, HIGHEST_CURRENT)
