"""The codec against the DBC by way of cantools, against the published protection, and against damage."""

import math

import pytest
from e2e.p05 import e2e_p05_protect
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_driver.can_library import cantools
from mount_driver.layout import FrameError
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import DATABASE_FILE, Measurement, MountCodec, Setpoint, Status
from mount_models.quantity import ParameterError
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SETPOINT_TIMEOUT

CODEC = MountCodec()
DATABASE = cantools.database.load_file(DATABASE_FILE)
MEASUREMENT, SETPOINT, STATUS = DATABASE.messages
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
    alive_counter, decoded = CODEC.decode_measurement(data)
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


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_frames_made_by_cantools_are_read(data):
    raw = {
        signal.name: data.draw(
            st.integers(round(signal.minimum / signal.scale), round(signal.maximum / signal.scale))
        )
        for signal in MEASUREMENT.signals
    }
    frame, layout = bytearray(MEASUREMENT.encode(raw, scaling=False)), CODEC.measurement
    e2e_p05_protect(frame, layout.data_id, increment_counter=False)
    numbers = tuple(raw[name] for name in layout.names)
    assert layout.unpack(frame)[1:] == numbers[1:]  # all but the CRC
    assert layout.pack(numbers) == frame


@settings(max_examples=200, deadline=None)
@given(st.floats(0, 3), counters, bits, alive)
def test_a_setpoint_reads_as_cantools_reads_it(current, answered, enable, counter):
    data = CODEC.encode_setpoint(Setpoint(current, answered, enable), counter)
    values = SETPOINT.decode(bytes(data), decode_choices=False)
    decoded = CODEC.decode_setpoint(data)[1]
    assert nearly(values['Current'], 1e-4) == decoded.current == pytest.approx(current, abs=0.5001e-4)
    assert (values['AnsweredCounter'], values['Enable']) == (answered, enable)
    assert decoded[1:] == (answered, enable)


@settings(max_examples=200, deadline=None)
@given(st.floats(0, 60), st.floats(-60, 250), st.tuples(bits, bits, bits, bits, bits, bits), alive)
def test_a_status_reads_as_cantools_reads_it(voltage, temperature, faults, counter):
    data = CODEC.encode_status(Status(voltage, temperature, *faults), counter)
    values = STATUS.decode(bytes(data), decode_choices=False)
    decoded = CODEC.decode_status(data)[1]
    assert nearly(values['SupplyVoltage'], 1e-2) == decoded.supply_voltage
    assert nearly(values['CoilTemperature'], 1e-1) == decoded.coil_temperature_celsius
    names = ('OverTemperature', 'OverCurrent', 'UnderVoltage', 'SetpointTimeout', 'DisplacementSensor')
    assert tuple(values[name] for name in (*names, 'E2EError')) == decoded[2:] == faults


def test_status_that_is_not_available_is_nan_and_says_so_in_the_value_table():
    data = CODEC.encode_status(Status(math.nan, math.nan), 0)
    assert all(math.isnan(value) for value in CODEC.decode_status(data)[1][:2])
    values = STATUS.decode(bytes(data))
    assert str(values['SupplyVoltage']) == str(values['CoilTemperature']) == 'not available'


@pytest.mark.parametrize('slope', ['current_rate', 'flux_rate'])
def test_one_missing_slope_makes_both_unknown(slope):
    decoded = CODEC.decode_measurement(CODEC.encode_measurement(SAMPLE._replace(**{slope: math.nan}), 0))[1]
    assert math.isnan(decoded.current_rate)
    assert math.isnan(decoded.flux_rate)
    assert decoded.coil_current == SAMPLE.coil_current


@pytest.mark.parametrize('value', [0.0500001, -0.0500001, math.inf, -math.inf, 1e300])
def test_a_displacement_outside_its_range_is_refused_with_value_and_limit(value):
    with pytest.raises(ParameterError, match=r'Displacement \(.* m\) must lie within -0\.05 \.\. 0\.05 m'):
        CODEC.encode_measurement(SAMPLE._replace(displacement=value), 0)


@pytest.mark.parametrize(
    'change', [{'sample_counter': 65536}, {'sample_counter': -1}, {'microseconds': 2**32}]
)
def test_a_counter_that_does_not_fit_is_refused(change):
    with pytest.raises(ParameterError, match='does not fit its bits'):
        CODEC.encode_measurement(SAMPLE._replace(**change), 0)


def test_a_protected_frame_with_a_displacement_outside_the_limits_is_unknown():
    raw = dict.fromkeys(CODEC.measurement.names, 0) | {'DisplacementValid': 1, 'Displacement': 500_001}
    decoded = CODEC.decode_measurement(CODEC.measurement.pack([*raw.values()]))[1]
    assert math.isnan(decoded.displacement)


@pytest.mark.parametrize(('wanted', 'sent'), [(-0.1, 0.0), (3.0001, 3.0), (math.inf, 3.0), (-math.inf, 0.0)])
def test_a_setpoint_is_limited_to_0_to_3_ampere(wanted, sent):
    assert CODEC.decode_setpoint(CODEC.encode_setpoint(Setpoint(wanted, 1), 0))[1].current == sent


def test_a_setpoint_that_is_nan_is_refused():
    with pytest.raises(ParameterError, match=r'NaN.*0 \.\. 3 A'):
        CODEC.encode_setpoint(Setpoint(math.nan, 1), 0)


def test_a_received_setpoint_above_3_ampere_is_refused():
    raw = dict.fromkeys(CODEC.setpoint.names, 0) | {'Current': 30_001}
    assert CODEC.decode_setpoint(CODEC.setpoint.pack([*raw.values()])) == (
        0,
        None,
    )


@pytest.mark.parametrize(
    ('data', 'decode'),
    [
        (CODEC.encode_measurement(SAMPLE, 7), CODEC.decode_measurement),
        (CODEC.encode_setpoint(Setpoint(1.0, 3), 7), CODEC.decode_setpoint),
        (CODEC.encode_status(Status(13.8, 40.0), 7), CODEC.decode_status),
    ],
    ids=['measurement', 'setpoint', 'status'],
)
def test_every_single_flipped_bit_is_noticed(data, decode):
    for bit in range(len(data) * 8):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        with pytest.raises(FrameError, match='fails its CRC'):
            decode(damaged)


def test_a_frame_of_another_message_with_the_same_length_is_noticed():
    with pytest.raises(FrameError, match='fails its CRC'):
        CODEC.decode_status(CODEC.encode_setpoint(Setpoint(1.0, 3), 7))


@pytest.mark.parametrize('length', [0, 2, 23, 25, 64])
def test_a_frame_of_the_wrong_length_is_noticed(length):
    with pytest.raises(FrameError, match=f'has {length} bytes'):
        CODEC.decode_measurement(bytes(length))


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
    ]
    assert len({message.dbc.attributes['E2EDataId'].value for message in DATABASE.messages}) == 3
    for message in DATABASE.messages:
        assert message.is_fd
        assert message.comment
        assert all(signal.comment and signal.minimum is not None for signal in message.signals)


def test_the_dbc_tells_those_who_build_the_electronics_what_to_refuse():
    rule = DATABASE.buses[0].comment
    assert all(word in rule for word in ('repeated: not used', 'goes back: not used', 'E2ESyncFrames'))
    for layout in (CODEC.measurement, CODEC.setpoint, CODEC.status):
        assert (layout.max_delta_counter, layout.sync_frames) == (5, 3)
    assert 'repeated, of wrong sequence' in STATUS.get_signal_by_name('E2EError').comment


def test_the_dbc_agrees_with_what_both_ends_know_of_current_time_and_rate():
    assert (CODEC.current.low, CODEC.current.high) == (0.0, HIGHEST_CURRENT)
    assert [message.cycle_time for message in (MEASUREMENT, SETPOINT)] == [1e3 * SAMPLE_TIME] * 2
    limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
    timeout = MEASUREMENT.get_signal_by_name('SetpointTimeout'), STATUS.get_signal_by_name('SetpointTimeout')
    assert all(f'No valid setpoint for {limit}' in signal.comment for signal in timeout)
    assert f'Without a valid frame for {limit}' in SETPOINT.comment
    assert f'answers one of the last {round(SETPOINT_TIMEOUT / SAMPLE_TIME)} samples' in SETPOINT.comment
    assert DriverParameters().setpoint_timeout == SETPOINT_TIMEOUT


def test_scales_and_places_come_from_the_dbc(tmp_path):
    text = DATABASE_FILE.read_text(encoding='utf-8')
    text = text.replace('24|16@1+ (0.0001,0) [0|3] "A"', '24|12@1+ (0.001,0) [0|3] "A"')
    (tmp_path / 'other.dbc').write_text(text, encoding='utf-8')
    other = MountCodec(tmp_path / 'other.dbc')
    assert other.decode_setpoint(other.encode_setpoint(Setpoint(1.2344, 9), 0))[1] == Setpoint(1.234, 9)
