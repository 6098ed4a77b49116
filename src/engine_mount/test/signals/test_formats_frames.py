"""Raw CAN frames within MDF files, decoded by a user's database as those of logs are."""

import struct

import numpy as np
import pytest
from foreign_files import write_frames

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import read
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


@pytest.fixture
def stated(tmp_path):
    (tmp_path / 'rack.dbc').write_text(DBC)
    return Stated(dbc=tmp_path / 'rack.dbc')


def frames(buses=(1,)):
    """Return frames of motion at 200 Hz on each bus; on the second the travel is the negative one."""
    return [
        (time, bus, 256, struct.pack('<ii', travel if bus == 1 else -travel, 7))
        for time, travel in zip(TIMES.tolist(), TRAVEL.tolist(), strict=True)
        for bus in buses
    ]


def read_frames(path, written, stated, columns=None):
    write_frames(path, written)
    return read(path, columns, stated)


def test_a_signal_has_the_times_of_its_frames_and_short_ones_are_left_out(stated, tmp_path):
    written = [
        (time, bus, key, data[:3] if place % 10 == 3 else data)
        for place, (time, bus, key, data) in enumerate(frames())
    ]
    heat = (0.5, 1, 0x18FEC9FE | 1 << 31, struct.pack('<H', 600))
    measured = read_frames(tmp_path / 'a.mf4', [*written, heat], stated)
    travel, kept = measured.column('Motion.travel'), TRAVEL % 10 != 3
    np.testing.assert_allclose(travel.values, 1e-3 * TRAVEL[kept])
    np.testing.assert_allclose(travel.time.times, TIMES[kept], atol=1e-9)
    assert (travel.unit, measured.provenance.reader) == ('mm', 'asammdf, cantools')
    assert measured.column('Heat.coil').values.tolist() == [20.0]
    assert 'Motion: 20 of 200 frames do not decode' in ' '.join(measured.notes)


def test_a_message_on_two_buses_is_two_and_unknown_frames_are_told(stated, tmp_path):
    measured = read_frames(tmp_path / 'a.mf4', [*frames((1, 2)), (1.0, 1, 0x333, b'123')], stated)
    for bus, sign in ((1, 1e-3), (2, -1e-3)):
        np.testing.assert_allclose(measured.column(f'{bus}/Motion.travel').values, sign * TRAVEL)
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
    measured = read(tmp_path / 'b.mf4')
    assert list(measured.columns) == ['oil']
    assert 'raw CAN frames are left out; --dbc' in ' '.join(measured.notes)


def test_frames_without_their_database_and_with_another_are_refused(stated, tmp_path):
    (tmp_path / 'other.dbc').write_text(DBC.replace('256', '257'))
    with pytest.raises(SignalError, match=r'no frame that other\.dbc names \(0x100 \(200\)\)'):
        read_frames(tmp_path / 'a.mf4', frames(), Stated(dbc=tmp_path / 'other.dbc'))
    with pytest.raises(SignalError, match=r'a\.mf4 holds raw CAN frames; name the database .* with --dbc'):
        read(tmp_path / 'a.mf4')


def test_j1939_is_matched_by_group_a_column_for_each_source_without_values_not_available(tmp_path):
    (tmp_path / 'truck.dbc').write_text(
        'VERSION ""\nBU_: E\nBO_ 2364540158 EEC1: 8 E\n SG_ speed : 24|16@1+ (0.125,0) [0|8031.875] "rpm" E\n'
    )
    engine, other = 0x0CF00400 | 1 << 31, 0x18F00427 | 1 << 31  # other priority and source than 0x0CF004FE
    written = [
        (0.01 * place, 1, key, struct.pack('<BBBHBBB', 0, 0, 0, raw, 0, 0, 0))
        for place in range(20)
        for key, raw in ((engine, 0xFFFF if place == 3 else 8 * place), (other, 0xFAFF))
    ]
    measured = read_frames(tmp_path / 'a.mf4', written, Stated(dbc=tmp_path / 'truck.dbc'))
    speed = measured.column('0x00/EEC1.speed')
    assert speed.values.tolist() == [float(place) for place in range(20) if place != 3]
    assert set(measured.column('0x27/EEC1.speed').values.tolist()) == {8031.875}
    assert '1 of 20 samples are sent as not available or as errors (above 8031.88)' in ' '.join(
        measured.notes
    )
