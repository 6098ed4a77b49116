"""`ls` and `info`: which recordings there are, and what one of them is."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from engine_mount.cli.command import app
from engine_mount.settings.changes import changed_parameters
from mount_models.specimen import default_specimen

DRIVE = ('--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')
CHANGED = ('--set', 'switch_on_level=0.0007', '--set', 'policy=switched_viscous', '--no-report')
RUNNER = CliRunner(env={'COLUMNS': '80', 'NO_COLOR': '1'})


def run(*arguments):
    return RUNNER.invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a folder with a run, a recording beside it that is cut off, one alone, and what is none."""
    folder = tmp_path_factory.mktemp('made') / 'bags'
    done = run('drive', *DRIVE, *CHANGED, '--out', folder / 'run')
    assert done.exit_code == 0, done.output
    shutil.copytree(folder / 'run' / 'recording', folder / 'alone')
    broken = folder / 'broken'
    shutil.copytree(folder / 'alone', broken)
    file = next(broken.glob('*.mcap'))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (folder / 'notes').mkdir()
    return folder


def test_recordings_are_listed_with_what_they_are(bags, tmp_path):
    done = run('ls', bags, '--json', tmp_path / 'ls.json')
    assert done.exit_code == 0, done.output
    assert max(map(len, done.output.replace(str(bags), 'bags').splitlines())) <= 80
    assert f'{bags / "run"}: nothing lost, no faults\n' in done.output
    assert f'{bags / "alone"}: whole\n' in done.output
    assert 'notes' not in done.output
    found = {one['recording']: one for one in json.loads((tmp_path / 'ls.json').read_text())['recordings']}
    assert len(found) == 3
    one = found[str(bags / 'run')]
    assert one['duration_s'] == pytest.approx(3.4)
    told = [one[name] for name in ('scenario', 'mode', 'mount', 'policy', 'sound')]
    assert told == ['bench', 'core', 'friction', 'switched_viscous', True]
    assert found[str(bags / 'alone')]['sound'] is None
    assert found[str(bags / 'broken')]['sound'] is False


def test_the_verdict_is_that_of_the_summary(bags, tmp_path):
    shutil.copytree(bags / 'run', tmp_path / 'lost')
    summary = tmp_path / 'lost' / 'summary.json'
    summary.write_text(json.dumps({**json.loads(summary.read_text()), 'lost_samples': 3, 'faults': [{}]}))
    assert 'lost: samples lost: 3, faults: 1\n' in run('ls', tmp_path).output


def test_what_cannot_be_listed_is_told(tmp_path):
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'bad').mkdir()
    (tmp_path / 'bad' / 'x.mcap').write_bytes(b'none')
    assert 'no recordings in' in run('ls', tmp_path / 'empty').output
    assert run('ls', tmp_path).exit_code == 0
    assert 'bad: ' in run('ls', tmp_path).output
    refused = run('ls', tmp_path / 'nowhere')
    assert isinstance(refused.exception, ValueError)
    assert 'nowhere: no such folder' in str(refused.exception)


def test_a_recording_is_told_with_what_was_not_at_its_default(bags, tmp_path):
    done = run('info', bags / 'run', '--json', tmp_path / 'info.json')
    assert done.exit_code == 0, done.output
    assert 'bench, core' in done.output
    told = json.loads((tmp_path / 'info.json').read_text())
    assert told['changed_parameters']['mount_control'] == {
        'switch_on_level': {'value': 0.0007, 'default': 0.0008},
        'policy': {'value': 'switched_viscous', 'default': 'continuous_viscous'},
    }
    assert told['topics']['/displacement'] == {'type': 'sensor_msgs/msg/JointState', 'messages': 3400}
    assert told['gaps']['']['contact_gap'] == pytest.approx(349e-6, abs=2e-6)
    assert (told['lost_samples'], told['whole'], told['replay']) == (0, True, False)
    assert set(told['versions']) > {'python', 'numpy'}
    assert max(map(len, [line for line in done.output.splitlines() if line.startswith(' ')])) <= 80


def test_friction_of_the_shipped_specimen_is_no_change():
    identified = default_specimen().friction['b_offset']
    assert changed_parameters({'mount_control': {'friction.b_offset': identified}}) == {}
    changed = changed_parameters({'mount_control': {'friction.b_offset': -14.0}})
    assert changed == {'mount_control': {'friction.b_offset': (-14.0, identified)}}


def test_a_replay_is_called_one(bags, tmp_path):
    assert run('replay', bags / 'run', '--out', tmp_path / 'again').exit_code == 0
    assert 'replay of bench' in run('info', tmp_path / 'again').output
    assert 'replay of bench' in run('ls', tmp_path).output


def test_a_damaged_recording_is_told_as_one(bags):
    done = run('info', bags / 'broken')
    assert done.exit_code == 0
    assert 'not whole' in done.output
