"""`ls`, `info`, `audit`, `record`, `recover`: which recordings there are, and what one of them is."""

import json
import shutil

import pytest
from command_line import command

import engine_mount
from engine_mount.cli.commands.record import _print_losses
from engine_mount.cli.screen import TerminalScreen
from mount_recorder.bag_writer import BagWriter
from mount_recorder.losses import Reception
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DIAGNOSTICS, DISPLACEMENT, TOPICS

START = 1_700_000_000_000_000_000  # ns, any time
EMPTY_DIAGNOSTICS = b'\0\1\0\0' + bytes(16)
DRIVE = ('--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')
CHANGED = ('--set', 'switch_on_level=0.0007', '--set', 'policy=switched_viscous', '--no-report')


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a folder with a run, a recording beside it that is cut off, one alone, and what is none."""
    folder = tmp_path_factory.mktemp('made') / 'bags'
    command('drive', *DRIVE, *CHANGED, '--out', folder / 'run')
    for name in ('alone', 'broken'):
        shutil.copytree(folder / 'run' / 'recording', folder / name)
    file = next((folder / 'broken').glob('*.mcap'))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (folder / 'notes').mkdir()
    return folder


def test_recordings_are_listed_with_what_they_are(bags, tmp_path):
    printed = command('ls', bags, '--json', tmp_path / 'ls.json')
    assert max(map(len, printed.replace(str(bags), 'bags').splitlines())) <= 80
    assert f'{bags / "run"}: nothing lost, no faults\n' in printed
    assert f'{bags / "alone"}: whole\n' in printed
    found = {one['recording']: one for one in json.loads((tmp_path / 'ls.json').read_text())['recordings']}
    assert len(found) == 3
    one = found[str(bags / 'run')]
    assert one['duration_s'] == pytest.approx(3.4)
    told = [one[name] for name in ('scenario', 'mode', 'mount', 'policy', 'sound')]
    assert told == ['bench', 'core', 'friction', 'switched_viscous', True]
    assert [found[str(bags / name)]['sound'] for name in ('alone', 'broken')] == [None, False]


def test_the_verdict_is_that_of_the_summary(bags, tmp_path):
    shutil.copytree(bags / 'run', tmp_path / 'lost')
    summary = tmp_path / 'lost' / 'summary.json'
    summary.write_text(json.dumps({**json.loads(summary.read_text()), 'lost_samples': 3, 'faults': [{}]}))
    assert 'lost: samples lost: 3, faults: 1\n' in command('ls', tmp_path)
    assert 'no recordings in' in command('ls', bags / 'notes')


def test_a_recording_is_told_with_what_was_not_at_its_default(bags, tmp_path):
    printed = command('info', bags / 'run', '--json', tmp_path / 'info.json')
    assert 'bench, core' in printed
    told = json.loads((tmp_path / 'info.json').read_text())
    assert told['changed_parameters']['mount_control'] == {
        'switch_on_level': {'value': 0.0007, 'default': 0.0008},
        'policy': {'value': 'switched_viscous', 'default': 'continuous_viscous'},
    }
    assert told['topics']['/displacement'] == {'type': 'sensor_msgs/msg/JointState', 'messages': 3400}
    assert told['gaps']['']['contact_gap'] == pytest.approx(349e-6, abs=2e-6)
    assert (told['lost_samples'], told['whole'], told['replay']) == (0, True, False)
    command('replay', bags / 'run', '--out', tmp_path / 'again')
    assert 'replay of bench' in command('info', tmp_path / 'again')
    assert 'replay of bench' in command('ls', tmp_path)
    assert 'not whole' in command('info', bags / 'broken')


def recorded(folder, messages):
    """Write what a recorder of all topics leaves that received {topic: messages}."""
    writer = BagWriter(folder)
    for topic in TOPICS:
        writer.add_topic(topic.name, topic.type)
    writer.receptions = {topic.name: Reception(len(messages.get(topic, ()))) for topic in TOPICS}
    for topic, raws in messages.items():
        for index, raw in enumerate(raws):
            writer.write(topic.name, raw, START + index * 1_000_000)
    writer.close()
    return folder


def displacements(count):
    layout = ScalarsLayout(DISPLACEMENT)
    return [layout.pack(START + index * 1_000_000, (0.0,)) for index in range(count)]


@pytest.mark.parametrize(
    ('messages', 'words'),
    [
        ({}, 'nothing was recorded'),
        ({DIAGNOSTICS: [EMPTY_DIAGNOSTICS]}, 'nothing was recorded'),
        ({DISPLACEMENT: displacements(5)}, 'Nothing is known to be lost: 1 topics are complete'),
    ],
)
def test_record_beside_no_graph_says_that_nothing_came(tmp_path, messages, words, capsys):
    sound = _print_losses(recorded(tmp_path / 'bag', messages), TerminalScreen())
    printed = capsys.readouterr().out
    assert words in printed
    assert ('known to be lost' in printed) is sound is (DISPLACEMENT in messages)


@pytest.mark.parametrize('place', ['', 'recording', 'recording/recording_0.mcap'])
def test_audit_and_recover_take_the_folder_of_a_run_its_recording_or_a_file(tmp_path, place):
    run = tmp_path / 'run'
    run.mkdir()
    recorded(run / 'recording', {DISPLACEMENT: displacements(5)})
    assert 'Nothing is known to be lost' in command('audit', run / place)
    command('edit', 'recover', run / place)
    (made,) = run.rglob('*_recovered')
    assert made.parent == (run if place == '' else (run / place).parent)
    assert engine_mount.open(made).message_count == 5
