"""`engine-mount fleet replay`: what it prints, what it writes, and how it refuses."""

import json
import shlex
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from engine_mount.cli.command import app
from engine_mount.fleet import job
from engine_mount.fleet.runner import Done
from engine_mount.signals.sources.source import SourceError

REFERENCES = Path(__file__).resolve().parents[4] / 'bags' / 'reference'
CHANGE = ['--set', 'mount_control.highest_current=0.7']


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """A folder with one recording and a damaged one, replayed in this process."""
    folder = tmp_path / 'fleet'
    shutil.copytree(REFERENCES / 'gap', folder / 'gap')
    (folder / 'broken.mcap').write_bytes(b'not a recording')
    monkeypatch.setattr(
        job,
        'run_tasks',
        lambda work, items, **_: (Done(place, work(each)) for place, each in enumerate(items)),
    )
    return folder


def command(*arguments):
    return CliRunner().invoke(app, ['fleet', 'replay', *map(str, arguments)])


def test_it_tells_how_many_have_no_figures_and_writes_what_it_tells(fleet, tmp_path):
    done = command(fleet, *CHANGE, '--out', tmp_path / 'result', '--json', tmp_path / 'figures.json')
    assert done.exit_code == 0, done.output
    assert 'recordings 2: 1 replayed, 1 failed' in done.output
    assert f'\nresult     {tmp_path / "result"}\n' in done.output
    asked = shlex.split(done.output.rpartition('note why 1 failed: engine-mount ')[2])
    assert 'broken.mcap' in CliRunner().invoke(app, asked).output
    figures = json.loads((tmp_path / 'figures.json').read_text(encoding='utf-8'))
    assert (figures['recordings'], figures['failed']) == (2, 1)
    assert figures['replayed_s'] > 1.0
    assert figures['real_time_factor'] == figures['replayed_s'] / figures['wall_s']
    assert Path(figures['result']).is_file()


def test_recordings_with_another_policy_are_told_apart(fleet, tmp_path):
    change = ['--set', 'continuous_viscous.full_amplitude=0.0006']
    done = command(fleet, *change, '--out', tmp_path / 'result')
    assert done.exit_code == 0, done.output
    assert 'recordings 2: 0 replayed, 1 with another policy, 1 failed' in done.output


def test_a_store_that_is_away_is_told_and_ends_with_1(fleet, tmp_path, monkeypatch):
    def away(uri):
        raise SourceError(f'{uri}: no answer')

    monkeypatch.setattr(job, 'local_copy', away)
    done = command(fleet, *CHANGE, '--out', tmp_path / 'result')
    assert done.exit_code == 1
    assert 'the same command tries it again' in ' '.join(done.output.split())


def test_without_a_change_there_is_nothing_to_ask(fleet, tmp_path):
    done = command(fleet, '--out', tmp_path / 'result')
    assert done.exit_code == 2
    assert '--set or --policy' in done.output
