"""Raw CAN frames within MDF files, decoded by a user's database as those of logs are."""

import struct

import numpy as np
import pytest
from foreign_files import write_frames

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.signal import SignalError

DBC = """VERSION ""
BU_: Rack
BO_ 256 Motion: 8 Rack
 SG_ travel : 0|32@1- (0.001,0) [0|0] "mm" Rack
 SG_ force : 32|32@1- (1,0) [0|0] "N" Rack

BO_ 2566834686 Heat: 2 Rack
 SG_ coil : 0|16@1+ (0.1,-40) [0|0] "degC" Rack

"""
TIMES = np.arange(200) * 0.005
TRAVEL = np.arange(200)  # um


def motion(travel):
    return struct.pack('<ii', travel, 7)


@pytest.fixture
def stated(tmp_path):
    (tmp_path / 'rack.dbc').write_text(DBC)
    return Stated(dbc=tmp_path / 'rack.dbc')


def frames(buses=(1,)):
    """Return frames of motion at 200 Hz on each bus; on the second the travel is the negative one."""
    return [
        (time, bus, 256, motion(travel if bus == 1 else -travel))
        for time, travel in zip(TIMES.tolist(), TRAVEL.tolist(), strict=True)
        for bus in buses
    ]


def test_a_signal_has_the_times_of_its_frames_and_the_unit_of_the_database(stated, tmp_path):
    write_frames(tmp_path / 'a.mf4', [*frames(), (0.5, 1, 0x18FEC9FE | 1 << 31, struct.pack('<H', 600))])
    measured = read(tmp_path / 'a.mf4', None, stated)
    travel = measured.column('Motion.travel')
    np.testing.assert_allclose(travel.values, 1e-3 * TRAVEL)
    np.testing.assert_allclose(travel.time.times, TIMES, atol=1e-9)
    assert (travel.unit, measured.provenance.reader) == ('mm', 'asammdf, cantools')
    assert measured.column('Heat.coil').values.tolist() == [20.0]


def test_frames_that_are_too_short_are_left_out_and_told(stated, tmp_path):
    short = [
        (time, bus, key, data[:3] if place % 10 == 3 else data)
        for place, (time, bus, key, data) in enumerate(frames())
    ]
    write_frames(tmp_path / 'a.mf4', short)
    measured = read(tmp_path / 'a.mf4', ['travel'], stated)
    kept = TRAVEL % 10 != 3
    np.testing.assert_allclose(measured.column('travel').values, 1e-3 * TRAVEL[kept])
    np.testing.assert_allclose(measured.column('travel').time.times, TIMES[kept], atol=1e-9)
    assert 'Motion: 20 of 200 frames do not decode' in ' '.join(measured.notes)


def test_a_message_on_two_buses_is_two_and_unknown_frames_are_told(stated, tmp_path):
    write_frames(tmp_path / 'a.mf4', [*frames((1, 2)), (1.0, 1, 0x333, b'123')])
    measured = read(tmp_path / 'a.mf4', None, stated)
    np.testing.assert_allclose(measured.column('2/Motion.travel').values, -1e-3 * TRAVEL)
    np.testing.assert_allclose(measured.column('1/Motion.travel').values, 1e-3 * TRAVEL)
    assert '1 frames of 1 identifiers that rack.dbc does not name: 0x333 (1)' in ' '.join(measured.notes)


def test_signals_beside_the_frames_are_read_with_them(stated, tmp_path):
    from asammdf import MDF, Signal

    write_frames(tmp_path / 'a.mf4', frames())
    with MDF(tmp_path / 'a.mf4') as file:
        file.append([Signal(np.cos(TIMES), TIMES, name='oil', unit='bar')])
        file.save(tmp_path / 'b.mf4')
    measured = read(tmp_path / 'b.mf4', ['force', 'oil'], stated)
    assert [one.name for one in measured.columns.values()] == ['Motion.force', 'oil']
    np.testing.assert_array_equal(measured.column('oil').values, np.cos(TIMES))
    np.testing.assert_array_equal(measured.column('force').values, 7.0)
    assert [one.name for one in headings(tmp_path / 'b.mf4')] == ['oil']
    assert 'raw CAN frames are left out; --dbc' in ' '.join(read(tmp_path / 'b.mf4').notes)


def test_frames_without_their_database_and_with_another_are_refused(stated, tmp_path):
    write_frames(tmp_path / 'a.mf4', frames())
    with pytest.raises(SignalError, match=r'a\.mf4 holds raw CAN frames; name the database .* with --dbc'):
        read(tmp_path / 'a.mf4')
    (tmp_path / 'other.dbc').write_text(DBC.replace('256', '257'))
    with pytest.raises(SignalError, match=r'no frame that other\.dbc names \(0x100 \(200\)\)'):
        read(tmp_path / 'a.mf4', None, Stated(dbc=tmp_path / 'other.dbc'))
