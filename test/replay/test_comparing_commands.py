"""The commands compare, cut and accept on drives of the simulated car."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from reference_differences import differences_from_reference
from rosbags.convert.converter import convert
from rosbags.typesys import Stores, get_typestore
from typer.testing import CliRunner, Result

from engine_mount.cli.command import app

DRIVE = (
    'drive',
    '--core',
    '--scenario',
    'bench',
    '--duration',
    '0.6',
    '--set',
    'mount_sim.timeline.start=2.8',
    '--set',
    'mount_control.policy=switched_viscous',
)
STORE = get_typestore(Stores.ROS2_JAZZY)
EARLIER = ('--set', 'mount_control.switch_on_level=0.0006')


def command(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope='module')
def run(tmp_path_factory) -> Callable[..., Path]:
    """Return the folder of a drive with these options, driven once."""
    driven: dict[tuple[str, ...], Path] = {}

    def driven_run(*options: str) -> Path:
        if options not in driven:
            folder = tmp_path_factory.mktemp('drive') / f'run_{len(driven)}'
            result = command(*DRIVE, *options, '--out', folder)
            assert result.exit_code == 0, result.output
            driven[options] = folder
        return driven[options]

    return driven_run


def test_a_drive_compared_with_itself_is_equal(run):
    result = command('compare', run(), run() / 'recording')
    assert result.exit_code == 0
    assert '- everything is equal to the bit' in result.output


def test_another_switching_level_is_told_in_words_and_figures(run, tmp_path):
    file = tmp_path / 'difference.json'
    result = command('compare', run(), run(*EARLIER), '--json', file)
    assert result.exit_code == 1
    first = result.output.splitlines()[1]
    assert first.startswith('- switched on 8 ms earlier in B')
    assert 'the sessions differ: only B tells mount_control.switch_on_level (0.0006)' in result.output
    figures = json.loads(file.read_text())
    assert figures['sentences'][0] == first.removeprefix('- ')
    assert figures['switching'][0]['moved_ms'] == pytest.approx(-8.0)


def test_what_a_tolerance_allows_is_equal(run):
    result = command('compare', run(), run(*EARLIER), '--tolerance', '100%', '--tolerance', 'switching=0.01')
    assert 'switched on' not in result.output


def test_recordings_without_common_topics_end_with_code_2(run, tmp_path):
    from mount_recorder.bag_writer import BagWriter

    writer = BagWriter(tmp_path / 'other')
    writer.add_topic('/other', 'std_msgs/msg/String')
    writer.close()
    result = command('compare', run(), tmp_path / 'other')
    assert result.exit_code == 2
    assert 'no topic is in both recordings' in result.output


def test_what_cannot_be_compared_is_not_called_different(run, tmp_path):
    for arguments in (
        (run(), tmp_path / 'nope'),
        (tmp_path / 'nope', run()),
        (run(), run(), '--tolerance', 'curent=1%'),
        (run(), run(), '--json', tmp_path / 'nope' / 'figures.json'),
        (run(),),
    ):
        assert command('compare', *arguments).exit_code == 2
    assert 'nope' in command('compare', run(), tmp_path / 'nope').output


@pytest.mark.slow
def test_of_two_mounts_in_one_recording_both_are_compared_by_their_names(run, tmp_path):
    left, right = ('--namespace', 'mount_left'), ('--namespace', 'mount_right')
    for name, changes in (('a', ()), ('b', EARLIER)):
        parts = run(*left), run(*right, *changes)
        places = [part / 'recording' for part in parts]
        convert(places, tmp_path / name, 'mcap', 9, None, 'file', STORE, None, (), (), (), ())
    file = tmp_path / 'difference.json'
    result = command('compare', tmp_path / 'a', tmp_path / 'b', '--json', file)
    assert result.exit_code == 1
    assert '- mount_right: switched on 8 ms earlier in B' in result.output
    assert 'mount_left: switched' not in result.output
    topics = json.loads(file.read_text())['topics']
    currents = {
        side: topics[f'mount_{side}/current_setpoint']['signals']['coil_current']['differing']
        for side in ('left', 'right')
    }
    assert currents['left'] == 0
    assert currents['right'] > 100


def test_a_cut_is_equal_in_the_common_time(run, tmp_path):
    assert command('cut', run(), '--to', '1500ms', '--out', tmp_path / 'begin').exit_code == 0
    assert command('compare', run(), tmp_path / 'begin').exit_code == 1
    assert command('compare', run(), tmp_path / 'begin', '--common').exit_code == 0


def test_a_cut_around_an_event_says_which(run, tmp_path):
    result = command(
        'cut',
        run(),
        '--event',
        'switch-on',
        '--before',
        '200ms',
        '--after',
        '0.1s',
        '--out',
        tmp_path / 'cut',
    )
    assert result.exit_code == 0
    assert 'around switch_on at 3.07' in result.output
    assert '3 latched ones from before' in result.output


def test_a_cut_needs_times_or_an_event(run, tmp_path):
    assert command('cut', run(), '--out', tmp_path / 'cut').exit_code == 2
    assert command('cut', run(), '--from', '1s', '--event', '1', '--out', tmp_path / 'cut').exit_code == 2


def test_a_cut_without_a_name_lies_beside_the_recording(run):
    result = command('cut', run(), '--from', '1s', '--to', '1.5s')
    assert result.exit_code == 0
    assert (run() / 'recording_1s_1.5s' / 'metadata.yaml').exists()


def test_a_reference_is_met_by_its_replay_and_not_by_another(run, tmp_path):
    references = tmp_path / 'reference'
    arguments = ('--reference', 'bench', '--folder', references)
    assert command('accept', run(), *arguments).exit_code == 2  # no reason
    accepted = command('accept', run(), *arguments, '--reason', 'the first')
    assert accepted.exit_code == 0
    reference = references / 'bench'
    replay = tmp_path / 'replay'
    replayed = command('replay', reference, '--core', '--out', replay)
    assert replayed.exit_code == 0, replayed.output
    (recording,) = (path.parent for path in replay.rglob('metadata.yaml'))
    assert differences_from_reference(reference, recording) == []
    told = differences_from_reference(reference, run(*EARLIER) / 'recording')
    assert told[0].startswith('switched on 8 ms earlier in B')
