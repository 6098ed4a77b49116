"""Each fault does what its name says, while it lasts and no longer."""

import math

import can
import pytest

from mount_driver.codec import MountCodec, Status
from mount_models.quantity import ParameterError
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults import FAULTS, Fault, FaultParameters

BEGIN, DURATION = 2.0, 0.5
TIMES = (1.999, 2.0, 2.25, 2.499, 2.5)
PRESENT = (False, True, True, True, False)
READING = Reading(1e-3, 0.5, 250.0, 80.0)


def _fault(kind):
    return Fault(FaultParameters(kind, BEGIN, DURATION))


@pytest.fixture
def frame():
    """Return a function that makes a sound measurement frame."""
    bus = can.Bus(interface='virtual', channel='test_faults', protocol=can.CanProtocol.CAN_FD)
    end = CanEnd(bus)
    yield lambda number: end.measurement_frame(number, 1000 * number, READING, enabled=True)
    end.close()


def _sound(arrived):
    try:
        return arrived is not None and MountCodec().decode_measurement(arrived.data) is not None
    except ValueError:
        return False


def test_an_unknown_fault_is_refused_with_the_known_ones():
    with pytest.raises(ParameterError, match=r"fault 'fire' is unknown; known are none, silence, .* deaf"):
        _fault('fire')


def test_every_fault_is_described():
    assert all(FAULTS.values())


def test_a_fault_lasts_as_long_as_it_is_told():
    for kind in set(FAULTS) - {'none'}:
        assert tuple(_fault(kind).present(time) for time in TIMES) == PRESENT, kind
    assert not any(_fault('none').present(time) for time in TIMES)


@pytest.mark.parametrize('kind', list(FAULTS))
def test_only_a_deaf_end_loses_setpoints(kind):
    deaf = tuple(_fault(kind).deaf(time) for time in TIMES)
    assert deaf == (PRESENT if kind == 'deaf' else (False,) * 5)


def test_an_invalid_displacement_is_nan_and_leaves_the_rest():
    fault = _fault('invalid_displacement')
    readings = [fault.reading(time, READING) for time in TIMES]
    assert [math.isnan(reading.displacement) for reading in readings] == list(PRESENT)
    assert all(reading[1:] == READING[1:] for reading in readings)


def test_a_stuck_displacement_repeats_the_last_reading_before_the_fault():
    fault = _fault('stuck_displacement')
    readings = [fault.reading(time, READING._replace(displacement=time)) for time in TIMES]
    assert [reading.displacement for reading in readings] == [1.999, 1.999, 1.999, 1.999, 2.5]


def test_a_missing_ripple_leaves_displacement_and_current():
    fault = _fault('no_ripple')
    for time, present in zip(TIMES, PRESENT, strict=True):
        reading = fault.reading(time, READING)
        assert (math.isnan(reading.current_rate), math.isnan(reading.flux_rate)) == (present, present)
        assert reading[:2] == READING[:2]


@pytest.mark.parametrize('kind', ['none', 'silence', 'lost_frames', 'wrong_crc', 'deaf'])
def test_faults_of_the_bus_leave_the_readings_alone(kind):
    assert [_fault(kind).reading(time, READING) for time in TIMES] == [READING] * 5


@pytest.mark.parametrize(
    ('kind', 'arriving'),
    [
        ('none', {0: True, 1: True, 2: True}),
        ('silence', {0: False, 1: False, 2: False}),
        ('lost_frames', {0: False, 1: True, 2: True}),
        ('wrong_crc', {0: False, 1: True, 2: True}),
        ('no_ripple', {0: True, 1: True, 2: True}),
    ],
)
def test_what_arrives_of_the_frames(frame, kind, arriving):
    fault = _fault(kind)
    for number in range(9):
        assert _sound(fault.frame(2.25, number, frame(number))) is arriving[number % 3]
        assert _sound(fault.frame(1.999, number, frame(number)))


def test_a_damaged_frame_still_arrives_and_a_lost_one_does_not(frame):
    assert _fault('wrong_crc').frame(2.25, 3, frame(3)) is not None
    assert _fault('lost_frames').frame(2.25, 3, frame(3)) is None


@pytest.mark.parametrize(
    ('kind', 'carried'),
    [
        ('none', [1.0, 1.0, 2.0, 0.0, 1.0]),
        ('over_current', [1.0, 1.0, 2.0, 0.0, 1.0]),
        ('coil_open', [1.0, 0.0, 0.0, 0.0, 1.0]),
        ('coil_half', [1.0, 0.5, 1.0, 0.0, 1.0]),
        ('coil_stuck', [1.0, 3.0, 3.0, 3.0, 1.0]),
        ('coil_stuck_on', [1.0, 1.0, 1.0, 1.0, 1.0]),
    ],
)
def test_what_the_coil_carries(kind, carried):
    fault = _fault(kind)
    wanted = (1.0, 1.0, 2.0, 0.0, 1.0)
    assert [fault.driven(time, current) for time, current in zip(TIMES, wanted, strict=True)] == carried


def test_a_stuck_coil_carries_what_it_is_told_to():
    assert Fault(FaultParameters('coil_stuck', BEGIN, DURATION, 0.75)).driven(BEGIN, 2.0) == 0.75


@pytest.mark.parametrize(
    ('kind', 'told'),
    [
        ('none', {}),
        ('coil_open', {}),
        ('over_current', {'over_current': True}),
        ('over_temperature', {'over_temperature': True}),
        ('under_voltage', {'under_voltage': True}),
        ('displacement_sensor', {'displacement_sensor': True}),
        ('hot_coil', {'coil_temperature_celsius': 250.0}),
        ('low_supply', {'supply_voltage': 5.0}),
        ('high_supply', {'supply_voltage': 24.0}),
    ],
)
def test_what_the_status_says(kind, told):
    sound = Status(14.0, 20.0, e2e_error=True)
    faulty = sound._replace(**told)
    said = [_fault(kind).status(time, sound) for time in TIMES]
    assert said == [faulty if present else sound for present in PRESENT]
