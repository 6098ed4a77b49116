"""`fleet index`: what it says, its exit codes, its figures."""

import json
import shlex
import shutil
from pathlib import Path

from typer.testing import CliRunner

from engine_mount.cli.command import app

REFERENCES = Path(__file__).parents[4] / 'bags' / 'reference'
RUNNER = CliRunner(env={'COLUMNS': '80', 'NO_COLOR': '1'})


def run(*arguments):
    return RUNNER.invoke(app, ['fleet', 'index', *map(str, arguments)])


def test_a_damaged_recording_is_counted_and_ends_nothing(tmp_path):
    shutil.copytree(REFERENCES / 'initialisation', tmp_path / 'drives' / 'first')
    (tmp_path / 'drives' / 'second.mcap').write_bytes(b'garbage')
    figures = tmp_path / 'index.json'
    done = run(tmp_path / 'drives', '--out', tmp_path / 'catalogue', '--workers', 1, '--json', figures)
    assert done.exit_code == 0, done.output
    lines = done.output.split()
    assert lines[:6] == ['read', '2', 'unchanged', '0', 'unreadable', '1']
    assert '\nnote why 1 is unreadable: engine-mount fleet query ' in done.output
    asked = shlex.split(done.output.rpartition('engine-mount ')[2])
    assert 'second.mcap' in RUNNER.invoke(app, asked).output
    told = json.loads(figures.read_text())
    assert told.pop('wall_s') > 0.0
    assert told == {
        'catalogue': str(tmp_path / 'catalogue'),
        'rows': 2,
        'read': 2,
        'unchanged': 0,
        'unreadable': 1,
    }
    again = run(tmp_path / 'drives', '--out', tmp_path / 'catalogue')
    assert again.output.split()[:4] == ['read', '0', 'unchanged', '2']


def test_a_place_that_is_not_there_is_refused_and_the_catalogue_stays(tmp_path):
    done = run(tmp_path / 'nowhere', '--out', tmp_path / 'catalogue')
    assert done.exit_code == 1
    assert 'nowhere: No such file or directory' in str(done.exception)
    assert not (tmp_path / 'catalogue').exists()
