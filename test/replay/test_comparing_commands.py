"""The commands compare, cut and accept on drives of the simulated car."""

import functools
import json

import pytest
from command_line import command, refused
from reference_differences import differences_from_reference

from mount_recorder.bag_writer import BagWriter

DRIVE = (
    '--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8',
    '--set', 'mount_control.policy=switched_viscous', '--no-report',
)  # fmt: skip
EARLIER = ('--set', 'mount_control.switch_on_level=0.0006')


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Return the folder of a drive with these options, driven once."""

    @functools.cache
    def run(*options):
        folder = tmp_path_factory.mktemp('drive') / 'run'
        command('drive', *DRIVE, *options, '--out', folder)
        return folder

    return run


def test_a_drive_compared_with_itself_is_equal(run):
    assert '- everything is equal to the bit' in command('compare', run(), run() / 'recording')


def test_another_switching_level_is_told_in_words_and_figures(run, tmp_path):
    file = tmp_path / 'difference.json'
    printed = command('compare', run(), run(*EARLIER), '--json', file, codes=(1,))
    first = printed.splitlines()[1]
    assert first.startswith('- switched on 8 ms earlier in B')
    assert 'the sessions differ: only B tells mount_control.switch_on_level (0.0006)' in printed
    figures = json.loads(file.read_text())
    assert figures['sentences'][0] == first.removeprefix('- ')
    assert figures['switching'][0]['moved_ms'] == pytest.approx(-8.0)
    tolerances = ('--tolerance', '100%', '--tolerance', 'switching=0.01')
    assert 'switched on' not in command('compare', run(), run(*EARLIER), *tolerances, codes=(0, 1))


def test_what_cannot_be_compared_is_not_called_different(run, tmp_path):
    writer = BagWriter(tmp_path / 'other')
    writer.add_topic('/other', 'std_msgs/msg/String')
    writer.close()
    for words, sentence in (
        ((run(), tmp_path / 'other'), 'no topic is in both recordings'),
        ((run(), tmp_path / 'nope'), 'nope'),
        ((tmp_path / 'nope', run()), 'nope'),
        ((run(), run(), '--tolerance', 'curent=1%'), 'curent'),
        ((run(), run(), '--json', tmp_path / 'nope' / 'figures.json'), 'nope'),
    ):
        assert sentence in refused('compare', *words, codes=(2,))


def test_a_cut_is_equal_in_the_common_time(run, tmp_path):
    command('edit', 'cut', run(), '--to', '1500ms', '--out', tmp_path / 'begin')
    command('compare', run(), tmp_path / 'begin', codes=(1,))
    command('compare', run(), tmp_path / 'begin', '--common')


def test_a_cut_around_an_event_says_which_and_lies_beside_the_recording_without_a_name(run, tmp_path):
    around = ('--event', 'switch-on', '--before', '200ms', '--after', '0.1s', '--out', tmp_path / 'cut')
    printed = command('edit', 'cut', run(), *around)
    assert 'around switch_on at 3.07' in printed
    assert '3 latched ones from before' in printed
    command('edit', 'cut', run(), '--from', '1s', '--to', '1.5s')
    assert (run() / 'recording_1s_1.5s' / 'metadata.yaml').exists()


def test_a_reference_is_met_by_its_replay_and_not_by_another(run, tmp_path):
    reference, replayed = tmp_path / 'references' / 'bench', tmp_path / 'replay'
    words = ('--reference', 'bench', '--folder', reference.parent, '--reason', 'the first')
    command('dev', 'accept', run(), *words)
    command('replay', reference, '--out', replayed)
    assert differences_from_reference(reference, replayed / 'recording') == []
    told = differences_from_reference(reference, run(*EARLIER) / 'recording')
    assert told[0].startswith('switched on 8 ms earlier in B')
