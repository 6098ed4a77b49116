"""Files of others as recordings: joined, cut at gaps, and read back by this project's reader."""

import csv
import json

import numpy as np
import pytest

import engine_mount
from engine_mount.recordings.cut import cut
from engine_mount.recordings.recording import open_recording
from engine_mount.recordings.session import recorded_session, session_content
from engine_mount.signals.formats.reading import read
from engine_mount.signals.importing.importing import import_files
from engine_mount.signals.mapping import ColumnChoice, Mapping
from engine_mount.signals.signal import SignalError

TIMES = np.arange(3000) / 1000.0
TRAVEL = 0.8e-3 * np.sin(2.0 * np.pi * 8.0 * TIMES)
SHAKING = 0.5 * np.sin(2.0 * np.pi * 12.0 * TIMES)


def table(path, columns):
    with path.open('w', newline='') as file:
        rows = csv.writer(file)
        rows.writerow(columns)
        rows.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
    return str(path)


def imported(tmp_path, *files, mapping=None, **more):
    return import_files(files, tmp_path / 'out', mapping=mapping or Mapping(), **more)


def test_titles_and_units_tell_what_columns_are(tmp_path):
    file = table(
        tmp_path / 'drive.csv',
        {
            't [ms]': 1e3 * TIMES,
            'Weg [mm]': 1e3 * TRAVEL + 3.0,
            'az [g]': SHAKING / 9.80665 + 1.0,
            'Nr': TIMES,
        },
    )
    done = imported(tmp_path, file)
    assert done.recordings == [tmp_path / 'out']
    assert done.samples == {'/displacement': 3000, '/sim/chassis_acceleration': 3000}
    recording = engine_mount.open(tmp_path / 'out')
    assert recording['displacement']['mount'] == pytest.approx(TRAVEL, abs=1e-9)
    assert recording['displacement'].stamps[0] == 1_000_000_000
    acceleration = recording['sim/chassis_acceleration']
    assert acceleration['linear_acceleration.z'] == pytest.approx(SHAKING + 9.80665)
    assert set(np.diff(acceleration.stamps)) == {1_000_000}
    assert any('subtracted (its mean)' in note for note in done.notes)


def test_the_session_tells_where_it_came_from(tmp_path):
    file = table(tmp_path / 'drive.csv', {'t': TIMES, 'x': 1e3 * TRAVEL, 'p': 2.0 + SHAKING})
    mapping = tmp_path / 'rack_2.yaml'
    mapping.write_text(
        'system: rack 2\ntime: {column: t, unit: s}\n'
        'columns: {displacement: {column: x, unit: mm, offset: 0.0}}\n'
        'others: {valve: {column: p, unit: bar}}\n'
    )
    imported(tmp_path, file, mapping=mapping)
    recording = open_recording(tmp_path / 'out')
    told = session_content(recorded_session(recording))
    assert told['scenario'] == 'imported'
    source = told['imported']['files'][0]
    assert source['file'] == 'drive.csv'
    assert len(source['sha256']) == 64
    assert told['imported']['mapping'] == {
        'file': 'rack_2.yaml', 'system': 'rack 2', 'time': {'column': 't', 'unit': 's'},
    }  # fmt: skip
    assert told['imported']['columns']['displacement']['factor'] == 1e-3
    assert told['imported']['topics']['/measured/valve'] == 'valve in Pa'
    assert recording['measured/valve']['valve'] == pytest.approx(1e5 * (2.0 + SHAKING))


def test_units_stand_in_the_channels_where_any_reader_finds_them(tmp_path):
    from mcap.reader import make_reader
    from rosbags.highlevel import AnyReader

    file = table(tmp_path / 'drive.csv', {'t': TIMES, 'x [mm]': 1e3 * TRAVEL, 'Kraft [kN]': 2.0 + SHAKING})
    names = {'displacement': ColumnChoice('x'), 'force': ColumnChoice('Kraft')}
    imported(tmp_path, file, mapping=Mapping(names))
    cut(open_recording(tmp_path / 'out'), tmp_path / 'piece', 0.5, 1.5)
    for place in (tmp_path / 'out', tmp_path / 'piece'):
        with next(place.glob('*.mcap')).open('rb') as stream:
            channels = make_reader(stream).get_summary().channels.values()
        told = {channel.topic: channel.metadata.get('units') for channel in channels}
        assert json.loads(told['/measured/force']) == {'force': 'N'}
        assert told['/displacement'] is None  # the registry tells it
        with AnyReader([place]) as reader:
            force = [link for link in reader.connections if link.topic == '/measured/force']
            found = [reader.deserialize(raw, link.msgtype) for link, _, raw in reader.messages(force)]
        series = open_recording(place)['measured/force']
        assert series['force'].tolist() == [message.position[0] for message in found]
        assert series.unit('force') == 'N'
        assert read(str(place), ['/measured/force.force']).column('/measured/force.force').unit == 'N'


def test_a_gap_parts_the_recording_and_is_told(tmp_path):
    keep = (TIMES < 1.0) | (TIMES > 1.2)
    file = table(tmp_path / 'drive.csv', {'t [s]': TIMES[keep], 'Weg [mm]': 1e3 * TRAVEL[keep]})
    done = imported(tmp_path, file)
    assert done.recordings == [tmp_path / 'out_1', tmp_path / 'out_2']
    assert done.lengths == pytest.approx([0.999, 1.798])
    assert any('a gap of 0.202 s at 0.999 s' in note for note in done.notes)
    second = engine_mount.open(tmp_path / 'out_2')['displacement']
    assert second.stamps[0] == 2_201_000_000
    assert (
        session_content(recorded_session(open_recording(tmp_path / 'out_2')))['imported']['piece'] == '2 of 2'
    )


def test_a_part_by_its_times(tmp_path):
    file = table(tmp_path / 'drive.csv', {'t [s]': TIMES, 'Weg [mm]': 1e3 * TRAVEL})
    done = imported(tmp_path, file, first=1.0, last=2.0)
    assert done.samples == {'/displacement': 1001}
    with pytest.raises(SignalError, match=r'from 5 s to .* nothing to take: the signals last 2\.999 s'):
        imported(tmp_path / 'other', file, first=5.0)
    assert not (tmp_path / 'other').exists()


def test_two_files_on_one_axis_and_messages_in_the_order_of_their_stamps(tmp_path):
    travel = table(tmp_path / 'weg.csv', {'t [s]': TIMES, 'Weg [mm]': 1e3 * TRAVEL})
    slow = TIMES[::7] + 0.0003
    force = table(tmp_path / 'kraft.csv', {'t [s]': slow, 'Kraft [kN]': np.cos(slow)})
    done = imported(tmp_path, travel, force)
    assert any('count from the same zero' in note for note in done.notes)
    recording = open_recording(tmp_path / 'out')
    assert recording['measured/force']['force'] == pytest.approx(1e3 * np.cos(slow))
    assert recording['measured/force'].stamps == pytest.approx(1e9 * (slow + 1.0), abs=1.0)
    from mcap.reader import make_reader

    with next((tmp_path / 'out').glob('*.mcap')).open('rb') as file:
        read = list(make_reader(file).iter_messages(log_time_order=False))
    assert len(read) == 3000 + slow.size + 1
    for topic in recording:
        times = [message.log_time for _, channel, message in read if channel.topic == topic]
        assert times == sorted(times)


def test_files_that_follow_each_other_become_one_drive(tmp_path):
    day = 1_700_000_000.0
    for name, part in (('a', TIMES < 1.5), ('b', TIMES >= 1.5)):
        table(tmp_path / f'{name}.csv', {'t [s]': day + TIMES[part], 'Weg [mm]': 1e3 * TRAVEL[part]})
    done = imported(tmp_path, str(tmp_path / 'b.csv'), str(tmp_path / 'a.csv'))
    assert done.samples == {'/displacement': 3000}
    table(tmp_path / 'c.csv', {'t [s]': day + TIMES, 'Weg [mm]': 1e3 * TRAVEL})
    with pytest.raises(SignalError, match=r'they overlap'):
        imported(tmp_path / 'other', str(tmp_path / 'a.csv'), str(tmp_path / 'c.csv'))


def test_what_no_title_tells_must_be_said(tmp_path):
    file = table(tmp_path / 'drive.csv', {'t': TIMES, 'x': TRAVEL})
    with pytest.raises(SignalError, match='say it with --column QUANTITY=COLUMN:UNIT'):
        imported(tmp_path, file)
