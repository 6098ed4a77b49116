"""`fleet index` and `fleet replay`: what they print, what they write, and how they refuse."""

import json
import shlex
import shutil
from pathlib import Path

import pytest
from command_line import command, refused
from references import REFERENCES_FOLDER

from engine_mount.fleet import job
from engine_mount.fleet.runner import Done
from engine_mount.signals.sources.uris import SourceError

CHANGE = ('--set', 'mount_control.highest_current=0.7')


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """A folder with one recording and a damaged one, read in this process."""
    shutil.copytree(REFERENCES_FOLDER / 'gap', tmp_path / 'fleet' / 'gap')
    (tmp_path / 'fleet' / 'broken.mcap').write_bytes(b'not a recording')

    def run_tasks(work, items, **_):
        return (Done(place, work(each)) for place, each in enumerate(items))

    monkeypatch.setattr(job, 'run_tasks', run_tasks)
    return tmp_path / 'fleet'


def test_an_index_counts_a_damaged_recording_and_reads_nothing_twice(fleet, tmp_path):
    figures, catalogue = tmp_path / 'index.json', tmp_path / 'catalogue'
    printed = command('fleet', 'index', fleet, '--out', catalogue, '--json', figures)
    assert printed.split()[:6] == ['read', '2', 'unchanged', '0', 'unreadable', '1']
    asked = shlex.split(printed.rpartition('note why 1 unreadable: engine-mount ')[2])
    assert 'broken.mcap' in command(*asked)
    told = json.loads(figures.read_text())
    assert told.pop('wall_s') > 0.0
    counts = {'rows': 2, 'read': 2, 'unchanged': 0, 'unreadable': 1}
    assert told == {'catalogue': str(catalogue), **counts}
    again = command('fleet', 'index', fleet, '--out', catalogue)
    assert again.split()[:4] == ['read', '0', 'unchanged', '2']


def test_a_replay_tells_how_many_have_no_figures_and_writes_what_it_tells(fleet, tmp_path):
    result = tmp_path / 'result'
    printed = command('fleet', 'replay', fleet, *CHANGE, '--out', result, '--json', tmp_path / 'f.json')
    assert 'recordings 2: 1 replayed, 1 failed' in printed
    assert f'\nresult     {result}\n' in printed
    asked = shlex.split(printed.rpartition('note why 1 failed: engine-mount ')[2])
    assert 'broken.mcap' in command(*asked)
    figures = json.loads((tmp_path / 'f.json').read_text(encoding='utf-8'))
    assert (figures['recordings'], figures['failed']) == (2, 1)
    assert figures['real_time_factor'] == figures['replayed_s'] / figures['wall_s']
    assert Path(figures['result']).is_file()


def test_recordings_with_another_policy_are_told_apart(fleet, tmp_path):
    change = ('--set', 'continuous_viscous.half_amplitude=0.00024')
    printed = command('fleet', 'replay', fleet, *change, '--out', tmp_path / 'result')
    assert 'recordings 2: 0 replayed, 1 with another policy, 1 failed' in printed


def test_a_store_that_is_away_is_told_and_ends_with_1(fleet, tmp_path, monkeypatch):
    def away(uri):
        raise SourceError(f'{uri}: no answer')

    monkeypatch.setattr(job, 'local_copy', away)
    said = refused('fleet', 'replay', fleet, *CHANGE, '--out', tmp_path / 'result', codes=(1,))
    assert 'the same command tries it again' in said
    assert '--set NAME=VALUE' in refused('fleet', 'replay', fleet, '--out', tmp_path / 'x', codes=(2,))
