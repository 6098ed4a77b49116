"""Every format in every command, each cell a file by a writer that is not of this project."""

import json

import numpy as np
import pytest
import yaml
from command import done
from foreign_files import MAKERS

import engine_mount
from engine_mount import fleet
from engine_mount.recordings.session import recorded_session, session_content

TIMES = np.arange(400) / 200.0  # s: 200 Hz, as vehicles record
TRAVEL = 0.8e-3 * np.sin(2.0 * np.pi * 8.0 * TIMES)  # m
SHAKING = 0.6 * np.sin(2.0 * np.pi * 7.0 * TIMES + 0.3)  # m/s^2
GRAVITY = 9.80665
COLUMNS = {'travel': ('mm', 1e3 * TRAVEL), 'az': ('g', SHAKING / GRAVITY + 1.0)}
UNITS = {'travel': 'mm', 'az': 'g'}


@pytest.fixture
def made(request, tmp_path):
    """Return a file of the format that the test names."""
    return MAKERS[request.param](tmp_path, 'drive', TIMES, COLUMNS)


def column(made, name):
    """Return how a user names a column: with its unit where the format holds none."""
    return made.names[name] + ('' if made.units else f':{UNITS[name]}')


def said(made):
    """Return the options that say what the file does not tell."""
    options = []
    if made.stated.rate is not None:
        options += ['--rate', made.stated.rate]
    if made.stated.dbc is not None:
        options += ['--dbc', made.stated.dbc]
    return options


FIRST = ('csv', 'mdf', 'mcap')
"""Formats that `make test` passes through the commands; `src/engine_mount/test/signals` reads all of them."""
each_format = pytest.mark.parametrize(
    'made',
    [pytest.param(name, marks=() if name in FIRST else pytest.mark.slow) for name in MAKERS],
    indirect=True,
)


@each_format
def test_drive(made, tmp_path):
    order = ['--scenario', 'recorded', '--file', made.path, '--column', column(made, 'az'), *said(made)]
    done('drive', '--core', '--no-report', '--duration', 1, *order, '--out', tmp_path / 'run')
    session = session_content(recorded_session(engine_mount.open(tmp_path / 'run' / 'recording')))
    given = session['parameters']['mount_sim']
    values = np.load(given['recorded.file'])
    assert values == pytest.approx(SHAKING + GRAVITY, abs=1e-5)
    told = session['given']['recorded.file']
    assert len(told['sha256']) == 64
    assert told['columns']['acceleration']['unit'] == 'g'


@each_format
def test_replay(made, tmp_path):
    order = ['--map', f'displacement={column(made, "travel")}', *said(made)]
    done('replay', made.path, *order, '--out', tmp_path / 'run')
    displacement = engine_mount.open(tmp_path / 'run' / 'recording')['displacement']
    assert displacement['mount'][::5][40:360] == pytest.approx(TRAVEL[40:360], abs=2e-6)


@each_format
def test_import(made, tmp_path):
    order = [f'displacement={column(made, "travel")}', '--column', f'acceleration={column(made, "az")}']
    done('import', made.path, '--column', *order, *said(made), '--out', tmp_path / 'made')
    recording = engine_mount.open(tmp_path / 'made')
    assert recording['displacement']['mount'][::5][40:360] == pytest.approx(TRAVEL[40:360], abs=2e-6)
    acceleration = recording['sim/chassis_acceleration']['linear_acceleration.z']
    assert acceleration[::5][40:360] == pytest.approx(SHAKING[40:360] + GRAVITY, abs=2e-4)


@pytest.mark.slow  # src/engine_mount/test/fleet/test_fleet_foreign.py indexes foreign files as well
@each_format
def test_fleet_index(made, tmp_path):
    files = tmp_path / 'drives'
    files.mkdir()
    for part in tmp_path.glob('drive*'):
        if part != files and part.suffix != '.dbc':
            part.rename(files / part.name)
    choices = {'displacement': 'travel', 'acceleration': 'az'}
    columns = {
        name: {'column': made.names[own]} | ({} if made.units else {'unit': UNITS[own]})
        for name, own in choices.items()
    }
    rate = {} if made.stated.rate is None else {'time': {'rate': made.stated.rate}}
    (tmp_path / 'system.yaml').write_text(yaml.safe_dump({'columns': columns} | rate), encoding='utf-8')
    dbc = [] if made.stated.dbc is None else ['--dbc', made.stated.dbc]
    order = ['--map', tmp_path / 'system.yaml', *dbc, '--out', tmp_path / 'catalogue', '--workers', 1]
    done('fleet', 'index', files, *order)
    (row,) = fleet.query(tmp_path / 'catalogue', 'select * from recordings').to_pylist()
    assert (row['kind'], row['reason']) == ('foreign', '')
    assert json.loads(row['mapped']) == {name: made.names[own] for name, own in choices.items()}
    units = json.loads(row['columns'])
    if made.units:
        assert sorted(unit for unit in units.values() if unit in UNITS.values()) == ['g', 'mm']
    assert row['rate_hz'] == pytest.approx(200.0)
    assert row['duration_s'] == pytest.approx(TIMES[-1])
    assert row['rms_displacement_m'] == pytest.approx(TRAVEL.std(), rel=0.01)
    assert row['rms_3_14_hz_m'] == pytest.approx(TRAVEL.std(), rel=0.15)
    assert row['rms_acceleration_m_s2'] == pytest.approx(SHAKING.std(), rel=0.02)


def test_what_was_imported_goes_through_the_other_commands(tmp_path):
    made = MAKERS['mdf'](tmp_path, 'drive', TIMES, COLUMNS)
    place = tmp_path / 'made'
    done(
        'import', made.path, '--column', 'displacement=travel', '--column', 'acceleration=az', '--out', place
    )
    assert 'imported' in done('info', place)
    done('audit', place)
    done('replay', place, '--out', tmp_path / 'replayed')
    done('cut', place, '--from', 0.5, '--to', 1.0, '--out', tmp_path / 'piece')
    done('compare', place, place)
    done(
        'drive',
        '--core',
        '--no-report',
        '--duration',
        1,
        '--scenario',
        'recorded',
        '--file',
        place,
        '--out',
        tmp_path / 'run',
    )
    done('report', place, '--out', tmp_path / 'page')


def test_other_readers_open_what_was_imported(tmp_path):
    from mcap.reader import make_reader
    from rosbags.highlevel import AnyReader

    made = MAKERS['csv'](tmp_path, 'drive', TIMES, COLUMNS)
    place = tmp_path / 'made'
    done('import', made.path, '--column', 'displacement=travel', '--out', place)
    with next(place.glob('*.mcap')).open('rb') as file:
        counts = make_reader(file).get_summary().statistics.message_count
    with AnyReader([place]) as reader:
        messages = [reader.deserialize(raw, link.msgtype) for link, _, raw in reader.messages()]
    assert counts == len(messages)
    assert sum(hasattr(message, 'position') for message in messages) == counts - 1
