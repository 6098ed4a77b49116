"""A file of others as a recording: brought to its rate, cut at gaps, and read back."""

import json

import numpy as np
import pytest
from loaded_modules import modules_after

import engine_mount
from engine_mount.recordings.edit import cut
from engine_mount.recordings.recording import open_recording
from engine_mount.recordings.session import recorded_session, session_content
from engine_mount.signals.formats.reading import read
from engine_mount.signals.importing import import_file
from engine_mount.signals.mapping import ColumnChoice, Mapping
from engine_mount.signals.signal import SignalError

TIMES = np.arange(3000) / 1000.0
TRAVEL = 0.8e-3 * np.sin(2.0 * np.pi * 8.0 * TIMES)
SHAKING = 0.5 * np.sin(2.0 * np.pi * 12.0 * TIMES)


@pytest.fixture
def imported(tmp_path):
    """A function that imports a table of columns {title: values}."""

    def run(columns, **how):
        rows, path = np.column_stack(list(columns.values())), tmp_path / 'drive.csv'
        np.savetxt(path, rows, '%.17g', delimiter=',', header=','.join(columns), comments='')
        return import_file(path, tmp_path / 'out', **how)

    return run


def session(folder):
    return session_content(recorded_session(open_recording(folder)))


def test_titles_and_units_tell_what_columns_are(imported, tmp_path):
    travel, shaking = 1e3 * TRAVEL + 3.0, SHAKING / 9.80665 + 1.0
    done = imported({'t [ms]': 1e3 * TIMES, 'Weg [mm]': travel, 'az [g]': shaking, 'Nr': TIMES})
    assert done.recordings == [tmp_path / 'out']
    assert done.samples == {'/displacement': 3000, '/sim/chassis_acceleration': 3000}
    recording = engine_mount.open(tmp_path / 'out')
    assert recording['displacement']['mount'] == pytest.approx(TRAVEL, abs=1e-9)
    assert recording['displacement'].stamps[0] == 1_000_000_000
    acceleration = recording['sim/chassis_acceleration']
    assert acceleration['linear_acceleration.z'] == pytest.approx(SHAKING + 9.80665)
    assert set(np.diff(acceleration.stamps)) == {1_000_000}
    assert any('subtracted (its mean)' in note for note in done.notes)


def test_an_import_at_1_khz_loads_neither_pandas_nor_what_compiles(imported, tmp_path):
    imported({'t [s]': TIMES, 'Weg [mm]': 1e3 * TRAVEL, 'force [N]': 1e5 * TRAVEL})
    program = f"import engine_mount as e; e.import_file('{tmp_path}/drive.csv', '{tmp_path}/again')"
    loaded = modules_after(program)
    assert 'engine_mount.signals.channels' in loaded
    assert not {'pandas', 'numba.np.linalg'} & loaded


def test_the_session_tells_where_it_came_from(imported, tmp_path):
    mapping = tmp_path / 'rack_2.yaml'
    mapping.write_text(
        'system: rack 2\ntime: {column: t, unit: s}\n'
        'columns: {displacement: {column: x, unit: mm, offset: 0.0}}\n'
        'others: {valve: {column: p, unit: bar}}\n'
    )
    imported({'t': TIMES, 'x': 1e3 * TRAVEL, 'p': 2.0 + SHAKING}, mapping=mapping)
    told = session(tmp_path / 'out')
    assert told['scenario'] == 'imported'
    source = told['imported']['files'][0]
    assert (source['file'], len(source['sha256'])) == ('drive.csv', 64)
    assert told['imported']['mapping'] == {
        'file': 'rack_2.yaml', 'system': 'rack 2', 'time': {'column': 't', 'unit': 's'},
    }  # fmt: skip
    assert told['imported']['columns']['displacement']['factor'] == 1e-3
    assert told['imported']['topics']['/measured/valve'] == 'valve in Pa'
    valve = open_recording(tmp_path / 'out')['measured/valve']['valve']
    assert valve == pytest.approx(1e5 * (2.0 + SHAKING))


def test_units_stand_in_the_channels_where_any_reader_finds_them(imported, tmp_path):
    from mcap.reader import make_reader
    from rosbags.highlevel import AnyReader

    names = {'displacement': ColumnChoice('x'), 'force': ColumnChoice('Kraft')}
    columns = {'t': TIMES, 'x [mm]': 1e3 * TRAVEL, 'Kraft [kN]': 2.0 + SHAKING}
    imported(columns, mapping=Mapping(names))
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
        assert read(str(place), ['/measured/force.force']).column('/measured/force.force').unit == 'N'


def test_a_gap_parts_the_recording_and_is_told(imported, tmp_path):
    keep = (TIMES < 1.0) | (TIMES > 1.2)
    done = imported({'t [s]': TIMES[keep], 'Weg [mm]': 1e3 * TRAVEL[keep]})
    assert done.recordings == [tmp_path / 'out_1', tmp_path / 'out_2']
    assert done.lengths == pytest.approx([0.999, 1.798])
    assert any('a gap of 0.202 s at 0.999 s' in note for note in done.notes)
    assert engine_mount.open(tmp_path / 'out_2')['displacement'].stamps[0] == 2_201_000_000
    assert session(tmp_path / 'out_2')['imported']['piece'] == '2 of 2'


def test_other_quantities_stay_as_sampled_in_the_order_of_their_stamps(imported, tmp_path):
    force = np.where(np.arange(3000) % 7, np.nan, np.cos(TIMES))
    done = imported({'t [s]': TIMES + 0.25, 'Weg [mm]': 1e3 * TRAVEL, 'Kraft [kN]': force})
    recording = open_recording(tmp_path / 'out')
    assert recording['measured/force']['force'] == pytest.approx(1e3 * np.cos(TIMES[::7]))
    assert recording['measured/force'].stamps == pytest.approx(1e9 * (TIMES[::7] + 1.25), abs=1.0)
    assert 'stamps are those of the file and 1.000 s' in done.notes
    from mcap.reader import make_reader

    with next((tmp_path / 'out').glob('*.mcap')).open('rb') as file:
        read = list(make_reader(file).iter_messages(log_time_order=False))
    assert len(read) == 3000 + TIMES[::7].size + 1
    times = [message.log_time for _, channel, message in read if channel.topic == '/measured/force']
    assert times == sorted(times)


def test_what_no_title_tells_must_be_said(imported, tmp_path):
    with pytest.raises(SignalError, match='say it with --column QUANTITY=COLUMN:UNIT'):
        imported({'t': TIMES, 'x': TRAVEL})
    assert not (tmp_path / 'out').exists()
