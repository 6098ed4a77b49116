"""Every format in every command, each cell a file by a writer that is not of this project."""

import numpy as np
import pytest
from command_line import command as done
from foreign_files import MAKERS

import engine_mount
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
    return [] if made.stated.dbc is None else ['--dbc', made.stated.dbc]


each_format = pytest.mark.parametrize('made', ['csv', 'mdf', 'mcap'], indirect=True)
"""Formats that pass through the commands; `src/engine_mount/test/signals` reads all of them."""


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
def test_import(made, tmp_path):
    order = [f'displacement={column(made, "travel")}', '--column', f'acceleration={column(made, "az")}']
    done('import', made.path, '--column', *order, *said(made), '--out', tmp_path / 'made')
    recording = engine_mount.open(tmp_path / 'made')
    assert recording['displacement']['mount'][::5][40:360] == pytest.approx(TRAVEL[40:360], abs=2e-6)
    acceleration = recording['sim/chassis_acceleration']['linear_acceleration.z']
    assert acceleration[::5][40:360] == pytest.approx(SHAKING[40:360] + GRAVITY, abs=2e-4)


def test_what_was_imported_goes_through_the_other_commands(tmp_path):
    made = MAKERS['mdf'](tmp_path, 'drive', TIMES, COLUMNS)
    place = tmp_path / 'made'
    done(
        'import', made.path, '--column', 'displacement=travel', '--column', 'acceleration=az', '--out', place
    )
    assert 'imported' in done('info', place)
    done('audit', place)
    done('replay', place, '--out', tmp_path / 'replayed')
    done('edit', 'cut', place, '--from', 0.5, '--to', 1.0, '--out', tmp_path / 'piece')
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
