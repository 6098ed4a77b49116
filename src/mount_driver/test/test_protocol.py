"""The codec against the DBC by way of cantools, against the published protection, and against damage."""

import math

import pytest
from e2e.p05 import e2e_p05_protect
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_driver.can_library import cantools
from mount_driver.protocol import DATABASE_FILE, Measurement, MountCodec, Setpoint, Status
from mount_models.quantity import ParameterError
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SETPOINT_TIMEOUT

CODEC = MountCodec()
DATABASE = cantools.database.load_file(DATABASE_FILE)
MEASUREMENT, SETPOINT, STATUS, *_ = DATABASE.messages
SAMPLE = Measurement(1234, 4_000_000_000, 0.0012345, 0.5002, -1234.567, 99.1234, True, False, True)

counters = st.integers(0, 0xFFFF)
alive = st.integers(0, 0xFF)
bits = st.booleans()


def reading(limit):
    return st.floats(-limit, limit) | st.just(math.nan)


measurements = st.builds(
    Measurement,
    counters,
    st.integers(0, 2**32 - 1),
    reading(0.05),
    reading(6.5),
    reading(1e5),
    reading(1e4),
    bits,
    bits,
    bits,
)


def nearly(value, scale):
    """Equal but for the last bit, in which cantools' product and our quotient may differ; NaN equals NaN."""
    return pytest.approx(value, rel=4e-16, abs=scale * 1e-9, nan_ok=True)


@settings(max_examples=300, deadline=None)
@given(measurements, alive)
def test_a_measurement_reads_as_cantools_reads_it(measurement, counter):
    data = CODEC.encode_measurement(measurement, counter)
    values = MEASUREMENT.decode(bytes(data), decode_choices=False)
    alive_counter, decoded = CODEC.measurement.decode(data)
    assert values['AliveCounter'] == alive_counter == counter
    assert values['SampleCounter'] == decoded.sample_counter == measurement.sample_counter
    assert values['Microseconds'] == decoded.microseconds == measurement.microseconds
    assert values['Enabled'] == decoded.enabled == measurement.enabled
    assert values['SetpointTimeout'] == decoded.setpoint_timeout == measurement.setpoint_timeout
    assert values['CurrentLimited'] == decoded.current_limited == measurement.current_limited
    for valid, name, si, scale in (
        ('DisplacementValid', 'Displacement', decoded.displacement * 1e3, 1e-4),
        ('CurrentValid', 'CoilCurrent', decoded.coil_current, 2e-4),
        ('RippleValid', 'CurrentRate', decoded.current_rate, 1e-3),
        ('RippleValid', 'FluxRate', decoded.flux_rate, 1e-4),
    ):
        assert nearly(values[name] if values[valid] else math.nan, scale) == si


@pytest.mark.parametrize('message', DATABASE.messages, ids=lambda message: message.name)
@settings(max_examples=100, deadline=None)
@given(st.data())
def test_frames_are_those_of_cantools_to_the_bit(message, data):
    raw = {
        signal.name: data.draw(
            st.floats(signal.minimum, signal.maximum)
            if signal.is_float
            else st.integers(round(signal.minimum / signal.scale), round(signal.maximum / signal.scale))
        )
        for signal in message.signals
    }
    frame = bytearray(message.encode(raw, scaling=False))
    layouts = CODEC.measurement, CODEC.setpoint, CODEC.status, CODEC.own_setpoint, CODEC.table_point
    layout = next(each for each in layouts if each.name == message.name)
    e2e_p05_protect(frame, layout.data_id, increment_counter=False)
    numbers = tuple(raw[name] for name in layout.names)
    assert layout.is_sound(frame)
    assert layout.pack(numbers) == frame


def test_a_setpoint_and_a_status_have_the_values_of_the_database():
    setpoint, status = Setpoint(1.2345, 9, True), Status(13.82, 40.5, over_current=True, e2e_error=True)
    for message, layout, sent, data in (
        (SETPOINT, CODEC.setpoint, setpoint, CODEC.encode_setpoint(setpoint, 7)),
        (STATUS, CODEC.status, status, CODEC.encode_status(status, 7)),
    ):
        assert layout.decode(data) == (7, sent)
        _, *values = message.decode(bytes(data), decode_choices=False).values()
        assert values == pytest.approx([7, *map(float, sent)], rel=1e-9)


def test_status_that_is_not_available_is_nan_and_says_so_in_the_value_table():
    data = CODEC.encode_status(Status(math.nan, math.nan), 0)
    assert all(math.isnan(value) for value in CODEC.status.decode(data)[1][:2])
    values = STATUS.decode(bytes(data))
    assert str(values['SupplyVoltage']) == str(values['CoilTemperature']) == 'not available'


@pytest.mark.parametrize('value', [0.0500001, -0.0500001, math.inf, -math.inf, 1e300])
def test_a_displacement_outside_its_range_is_refused_with_value_and_limit(value):
    with pytest.raises(ParameterError, match=r'Displacement \(.* m\) must lie within -0\.05 \.\. 0\.05 m'):
        CODEC.encode_measurement(SAMPLE._replace(displacement=value), 0)


def test_a_protected_frame_with_a_displacement_outside_the_limits_is_unknown():
    raw = dict.fromkeys(CODEC.measurement.names, 0) | {'DisplacementValid': 1, 'Displacement': 500_001}
    decoded = CODEC.measurement.decode(CODEC.measurement.pack([*raw.values()]))[1]
    assert math.isnan(decoded.displacement)


@pytest.mark.parametrize(('wanted', 'sent'), [(-0.1, 0.0), (math.inf, 3.0)])
def test_a_setpoint_is_limited_to_0_to_3_ampere(wanted, sent):
    assert CODEC.setpoint.decode(CODEC.encode_setpoint(Setpoint(wanted, 1), 0))[1].current == sent
    for refused in (Setpoint(math.nan, 1), Setpoint(1.0, 65536)):
        with pytest.raises((ValueError, OverflowError)):
            CODEC.encode_setpoint(refused, 0)


@pytest.mark.parametrize(
    ('data', 'layout'),
    [
        (CODEC.encode_measurement(SAMPLE, 7), CODEC.measurement),
        (CODEC.encode_setpoint(Setpoint(1.0, 3), 7), CODEC.setpoint),
        (CODEC.encode_status(Status(13.8, 40.0), 7), CODEC.status),
    ],
    ids=['measurement', 'setpoint', 'status'],
)
def test_every_single_flipped_bit_is_noticed(data, layout):
    assert layout.is_sound(data)
    assert not layout.is_sound(data + b'0')
    for bit in range(len(data) * 8):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        assert not layout.is_sound(damaged)


def test_protection_is_autosar_profile_5():
    # The example of the AUTOSAR E2E protocol specification (FO_PRS_E2EProtocol, profile 5): data id 0x1234,
    # counter 0, eight bytes of zero. It fixes the polynomial, the byte order and the place of the data id.
    data = bytearray(8)
    e2e_p05_protect(data, 0x1234, increment_counter=False)
    assert data.hex() == '1cca000000000000'


def test_the_dbc_is_can_fd_complete_and_says_what_every_signal_means():
    assert [(m.name, m.frame_id, m.length, m.cycle_time) for m in DATABASE.messages] == [
        ('MountMeasurement', 0x210, 24, 1),
        ('MountSetpoint', 0x211, 8, 1),
        ('MountStatus', 0x212, 8, 100),
        ('MountOwnSetpoint', 0x213, 20, 1),
        ('MountLawTable', 0x214, 32, 1),
    ]
    assert len({message.dbc.attributes['E2EDataId'].value for message in DATABASE.messages}) == 5
    for message in DATABASE.messages:
        assert message.is_fd
        assert message.comment
        assert all(signal.comment and signal.minimum is not None for signal in message.signals)


def test_the_dbc_agrees_with_what_both_ends_know_of_current_time_and_rate():
    assert (CODEC.current.low, CODEC.current.high) == (0.0, HIGHEST_CURRENT)
    assert [message.cycle_time for message in (MEASUREMENT, SETPOINT)] == [1e3 * SAMPLE_TIME] * 2
    limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
    timeout = MEASUREMENT.get_signal_by_name('SetpointTimeout'), STATUS.get_signal_by_name('SetpointTimeout')
    assert all(f'No valid setpoint for {limit}' in signal.comment for signal in timeout)
    assert f'Without a valid frame for {limit}' in SETPOINT.comment
    assert f'answers one of the last {round(SETPOINT_TIMEOUT / SAMPLE_TIME)} samples' in SETPOINT.comment


def test_scales_and_places_come_from_the_dbc(tmp_path):
    text = DATABASE_FILE.read_text(encoding='utf-8')
    text = text.replace('24|16@1+ (0.0001,0) [0|3] "A"', '24|12@1+ (0.001,0) [0|3] "A"')
    (tmp_path / 'other.dbc').write_text(text, encoding='utf-8')
    other = MountCodec(tmp_path / 'other.dbc')
    assert other.setpoint.decode(other.encode_setpoint(Setpoint(1.2344, 9), 0))[1] == Setpoint(1.234, 9)
