"""The commands on recordings by URI: as on the same recording by path, and beside nothing of the cache."""

import json
from pathlib import Path

import fsspec
import pytest
from command_line import command, refused
from loaded_modules import modules_after
from references import REFERENCES_FOLDER

REFERENCE = REFERENCES_FOLDER / 'gap'
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


def made(tmp_path):
    return sorted(path.name for path in (tmp_path / 'here').iterdir())


def test_a_uri_gives_what_a_path_gives():
    assert command('audit', RUN) == command('audit', REFERENCE) == command('audit', REFERENCE.as_uri())
    assert 'everything is equal' in command('compare', RUN, REFERENCE)
    refused('compare', f'{STORE}/nothing', REFERENCE, codes=(2,))
    told = command('info', RUN)
    assert told.startswith(f'recording           {RUN}, whole')
    assert told.split('\n', 1)[1] == command('info', REFERENCE).split('\n', 1)[1]


def test_replay_takes_uris_of_a_recording_and_of_a_table():
    command('replay', RUN, '--out', 'replayed', '--json', 'replayed.json')
    command('replay', REFERENCE, '--out', 'same', '--json', 'same.json')
    first, second = (json.loads(Path(name).read_text()) for name in ('replayed.json', 'same.json'))
    assert {name: first[name] for name in KEPT} == {name: second[name] for name in KEPT}
    assert first['equal_to_recorded']
    assert 'measured in gap' in command('replay', RUN, '--table', RUN, '--out', 'other')


@pytest.mark.parametrize('inner', ['', '/gap_0.mcap'])
def test_what_is_made_of_a_uri_goes_into_the_current_folder(tmp_path, inner):
    command('edit', 'cut', RUN + inner, '--to', '1s')
    command('edit', 'recover', RUN + inner)
    command('report', RUN + inner)
    name = 'gap_0' if inner else 'gap'
    assert made(tmp_path) == [f'{name}_{what}' for what in ('0s_1s', 'recovered', 'report', 'report.html')]
    assert not [path for path in (tmp_path / 'copies').rglob('*') if 'recovered' in path.name]


def test_ls_lists_this_machine_alone():
    said = refused('ls', 'sftp://driver:hunter2@host/a')
    assert 'info URI fetches one recording' in said
    assert 'hunter2' not in said


@pytest.mark.parametrize('words', ['audit', 'info', 'view', 'report'])
def test_a_uri_with_a_password_is_refused_without_telling_it(words):
    said = refused(*words.split(), 'sftp://driver:hunter2@host/a')
    assert 'sftp://driver@host/a holds a password' in said
    assert 'hunter2' not in said


def test_a_path_loads_no_library_of_stores():
    loaded = modules_after('from engine_mount.cli.fetching import *; beside(local("bags/a", None), "")')
    assert not {'fsspec', 'aiohttp', 'asyncssh', 'numpy', 's3fs'} & loaded
