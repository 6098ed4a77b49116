"""The speed of the engine from a vehicle's bus, by a DBC that the test writes."""

import itertools
import math
import time

import pytest
from ros_testing import wait_until

from mount_driver.can_library import can
from mount_driver.engine_speed import EngineSpeedParameters, EngineSpeedReader, SpeedSignal
from mount_models.quantity import ParameterError

DBC = """VERSION ""
NS_ :
BS_:
BU_: Engine
BO_ 640 Standard: 8 Engine
 SG_ Speed : 7|16@0+ (0.5,0) [0|8000] "{unit}" Engine
 SG_ Temperature : 16|8@1- (1,0) [0|0] "degC" Engine
BO_ 2364540158 Extended: 8 Engine
 SG_ EngineSpeed : 24|16@1+ (0.125,0) [0|8031.875] "rpm" Engine
BO_ 641 Multiplexed: 4 Engine
 SG_ Page M : 0|8@1+ (1,0) [0|0] "" Engine
 SG_ Speed m1 : 8|16@1+ (1,0) [0|0] "rpm" Engine
"""
_names = itertools.count()


@pytest.fixture
def parameters(tmp_path):
    """Return a function that gives the parameters of a message in a DBC of its own."""

    def make(message='Standard', signal='Speed', unit='rpm'):
        file = tmp_path / 'car.dbc'
        file.write_text(DBC.format(unit=unit), 'cp1252')
        return EngineSpeedParameters(dbc=str(file), message=message, signal=signal)

    return make


@pytest.fixture
def listen():
    """Return a function that lets a reader listen, with the vehicle's end and what it publishes."""
    stack = []

    def begin(signal, threaded=True, channel=''):
        channel = channel or f'vehicle {next(_names)}'
        vehicle = can.Bus(channel, interface='virtual', protocol=can.CanProtocol.CAN_FD)
        found = []
        where = 'virtual', channel, 1024
        reader = EngineSpeedReader(signal, where, lambda *each: found.append(each), lambda ns: ns + 5)
        reader.start(threaded=threaded)
        stack.extend((reader.stop, vehicle.shutdown))
        wait_until(lambda: reader._bus is not None, 'the bus')
        return vehicle, reader, found

    yield begin
    for end in stack:
        end()


@pytest.mark.parametrize(
    ('unit', 'velocity'),
    [('rpm', 20.0 * math.pi), ('1/min', 20.0 * math.pi), ('Hz', 1200.0 * math.pi), ('rad/s', 600.0)],
)
def test_each_unit_becomes_rad_per_s(parameters, unit, velocity):
    signal = SpeedSignal(parameters(unit=unit))
    assert signal.velocity(bytes([1200 >> 8, 1200 & 0xFF, *bytes(6)])) == pytest.approx(velocity)


@pytest.mark.parametrize('data', [b'\xff\xff' + bytes(6), bytes([0x3E, 0x81]) + bytes(6), b'\x01'])
def test_beyond_the_limits_of_the_dbc_and_in_too_short_a_frame_it_is_not_known(parameters, data):
    assert math.isnan(SpeedSignal(parameters()).velocity(data))


def test_another_page_of_a_multiplexed_message_carries_none(parameters):
    signal = SpeedSignal(parameters('Multiplexed'))
    assert signal.velocity(bytes([1, 100, 0, 0])) == pytest.approx(100 * math.pi / 30.0)
    assert signal.velocity(bytes([0, 100, 0, 0])) is None


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        (
            {'dbc': '/no/car.dbc'},
            r'engine_speed.dbc: /no/car.dbc is not readable .*name a DBC, or leave it empty',
        ),
        (
            {'message': 'Standart'},
            "engine_speed.message: 'Standart' is no message of .*did you mean Standard",
        ),
        ({'signal': 'Sped'}, "engine_speed.signal: 'Sped' is no signal of Standard; did you mean Speed"),
        ({'signal': 'Temperature'}, "unit 'degC' in .*must be one of rpm, 1/min, Hz, rad/s: correct the DBC"),
    ],
)
def test_what_is_not_in_the_dbc_is_refused_with_the_remedy(parameters, changes, sentence):
    with pytest.raises(ParameterError, match=sentence):
        SpeedSignal(parameters()._replace(**changes))


def test_a_file_that_is_no_dbc_is_refused(parameters, tmp_path):
    values = parameters()
    (tmp_path / 'car.dbc').write_bytes(b'\x00\xffnothing')
    with pytest.raises(ParameterError, match=r'is not readable .*; name a DBC'):
        SpeedSignal(values)


@pytest.mark.parametrize(
    ('message', 'signal', 'threaded'), [('Standard', 'Speed', True), ('Extended', 'EngineSpeed', False)]
)
def test_a_frame_becomes_a_message_of_its_reception_and_nothing_is_ever_sent(
    parameters, listen, message, signal, threaded
):
    chosen = SpeedSignal(parameters(message, signal))
    vehicle, reader, found = listen(chosen, threaded)
    extended = message == 'Extended'
    number = chosen.message.frame_id
    data = chosen.message.encode({signal: 840.0} | ({} if extended else {'Temperature': 1}))
    begin = time.monotonic_ns()
    for wrong in (
        can.Message(arbitration_id=number + 1, data=data, is_extended_id=extended),
        can.Message(arbitration_id=number & 0x7FF, data=data, is_extended_id=not extended),
        can.Message(arbitration_id=number, is_error_frame=True, is_extended_id=extended),
        can.Message(arbitration_id=number, is_remote_frame=True, is_extended_id=extended),
    ):
        assert not chosen.carried_by(wrong)
        vehicle.send(wrong)
    vehicle.send(can.Message(arbitration_id=number, data=data, is_extended_id=extended))
    wait_until(lambda: found or (not threaded and reader.poll() and found), 'the message')
    ((stamp, velocity),) = found
    assert velocity == pytest.approx(28.0 * math.pi)
    assert begin + 5 <= stamp <= time.monotonic_ns() + 5
    assert reader.trouble(time.monotonic_ns()) == ''
    assert vehicle.recv(0.0) is None


def test_a_silent_bus_and_a_lost_bus_are_sentences_and_a_bus_that_is_back_is_read_again(
    parameters, listen, monkeypatch
):
    signal = SpeedSignal(parameters())
    vehicle, reader, found = listen(signal)
    assert reader.trouble(time.monotonic_ns()) == ''
    silent = reader.trouble(time.monotonic_ns() + 1_100_000_000)
    assert silent.startswith('engine_speed: no Standard on virtual vehicle')
    assert silent.endswith('for more than 1 s; is the vehicle awake, is engine_speed.channel right?')
    lost = reader._bus

    def fail(*_):
        raise can.CanOperationError('Network is down')

    monkeypatch.setattr(lost, 'recv', fail)
    wait_until(lambda: 'Network is down' in reader.trouble(time.monotonic_ns()), 'the loss')
    wait_until(lambda: reader._bus not in (None, lost), 'the bus again')
    vehicle.send(can.Message(arbitration_id=640, data=bytes(8), is_extended_id=False))
    wait_until(lambda: found, 'a message')
    assert reader.trouble(time.monotonic_ns()) == ''


def test_an_interface_that_is_not_there_is_a_sentence(parameters):
    reader = EngineSpeedReader(SpeedSignal(parameters()), ('socketcan', 'can7', 1024), print, int)
    reader.start(threaded=False)
    assert reader.trouble(0).startswith("engine_speed is not read: CAN interface 'socketcan', channel 'can7'")
    assert not reader.poll()
    reader.stop()
