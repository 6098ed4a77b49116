"""The commands on recordings by URI: as on the same recording by path, and beside nothing of the cache."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import fsspec
import pytest
from typer.testing import CliRunner

from engine_mount.cli.command import app
from engine_mount.signals.sources.source import SourceError

REFERENCE = Path(__file__).parents[4] / 'bags' / 'reference' / 'gap'
STORE = 'memory://drives'
RUN = f'{STORE}/gap'
KEPT = ('source', 'samples', 'equal_to_recorded', 'compared_setpoints', 'switch_on_s', 'peak_current_a')


@pytest.fixture(autouse=True)
def stored(tmp_path, monkeypatch):
    """Put a recording into a store; copies, and what commands make of it, go into folders of the test."""
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', str(tmp_path / 'copies'))
    (tmp_path / 'here').mkdir()
    monkeypatch.chdir(tmp_path / 'here')
    files = fsspec.filesystem('memory')
    files.put(str(REFERENCE), '/drives/gap', recursive=True)
    yield
    files.rm('/drives', recursive=True)


def run(*arguments, code=0):
    result = CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.output


def made(tmp_path):
    return sorted(path.name for path in (tmp_path / 'here').iterdir())


def test_audit_tells_the_same_of_a_uri_and_of_a_path():
    assert run('audit', RUN) == run('audit', REFERENCE) == run('audit', REFERENCE.as_uri())


def test_compare_takes_a_uri_beside_a_path():
    assert 'everything is equal' in run('compare', RUN, REFERENCE)


def test_a_comparison_with_what_cannot_be_fetched_is_none():
    run('compare', f'{STORE}/nothing', REFERENCE, code=2)
    run('compare', REFERENCE, 'sftp://driver:hunter2@host/a', code=2)


def test_replay_takes_uris_of_a_recording_and_of_a_table():
    told = run('replay', RUN, '--out', 'replayed', '--json', 'replayed.json')
    run('replay', REFERENCE, '--out', 'same', '--json', 'same.json')
    figures = [json.loads(Path(name).read_text()) for name in ('replayed.json', 'same.json')]
    first, second = ({name: value for name, value in one.items() if name in KEPT} for one in figures)
    assert first == second, told
    assert first['equal_to_recorded']
    assert 'measured in gap' in run('replay', RUN, '--table', RUN, '--out', 'other')


@pytest.mark.parametrize('inner', ['', '/gap_0.mcap'])
def test_what_is_made_of_a_uri_goes_into_the_current_folder(tmp_path, inner):
    run('cut', RUN + inner, '--to', '1s')
    run('recover', RUN + inner)
    name = 'gap_0' if inner else 'gap'
    assert made(tmp_path) == [f'{name}_0s_1s', f'{name}_recovered']
    assert not [path for path in (tmp_path / 'copies').rglob('*') if 'recovered' in path.name]


def test_a_report_about_a_uri_goes_into_the_current_folder(tmp_path):
    run('report', RUN)
    assert made(tmp_path) == ['gap_report', 'gap_report.html']


def test_info_tells_the_same_of_a_uri():
    told = run('info', RUN)
    assert told.startswith(f'recording           {RUN}, whole')
    assert told.split('\n', 1)[1] == run('info', REFERENCE).split('\n', 1)[1]


def test_a_run_by_uri_becomes_a_reference(tmp_path):
    shutil.copytree(REFERENCE, tmp_path / 'references' / 'gap')
    told = run('accept', RUN, '--reference', 'new', '--reason', 'a test', '--folder', tmp_path / 'references')
    assert 'new reference' in told


def test_ls_lists_this_machine_alone_and_tells_no_password():
    with pytest.raises(ValueError, match='info URI fetches one recording') as refused:
        run('ls', 'sftp://driver:hunter2@host/a')
    assert 'hunter2' not in str(refused.value)


@pytest.mark.parametrize('command', ['audit', 'info', 'cut --to 1s', 'view', 'report'])
def test_every_command_refuses_a_uri_with_a_password_without_telling_it(command):
    name, *options = command.split()
    result = CliRunner().invoke(app, [name, 'sftp://driver:hunter2@host/a', *options])
    assert isinstance(result.exception, SourceError)  # which the command tells in a sentence, exit code 1
    assert 'sftp://driver@host/a holds a password' in str(result.exception)
    assert 'hunter2' not in result.output + str(result.exception)


def test_a_path_loads_no_library_of_stores():
    tell = (
        'import sys; from engine_mount.cli.fetching import local, beside; from pathlib import Path;'
        'beside(local("bags/a", None)); print(*sys.modules)'
    )
    loaded = subprocess.run([sys.executable, '-c', tell], capture_output=True, text=True, check=True).stdout
    assert not {'fsspec', 'aiohttp', 'asyncssh', 'numpy', 's3fs'} & set(loaded.split())
