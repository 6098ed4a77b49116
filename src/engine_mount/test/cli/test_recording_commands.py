"""The commands record, audit and recover on recordings that no graph is needed for."""

import io
import shutil

import pytest
from rich.console import Console
from typer.testing import CliRunner

import engine_mount
from engine_mount.cli.command import app
from engine_mount.cli.commands.record import _told
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import losses, sentences
from mount_recorder.bag_writer import BagWriter
from mount_recorder.losses import Reception
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DIAGNOSTICS, DISPLACEMENT, TOPICS

START = 1_700_000_000_000_000_000  # ns, any time
EMPTY_DIAGNOSTICS = b'\0\1\0\0' + bytes(16)


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


def verdict(recording):
    audits = audit(recording)
    return sentences(audits, losses(recording, audits))[-1]


def test_an_empty_recording_is_not_said_to_be_complete(tmp_path):
    recording = engine_mount.open(recorded(tmp_path / 'bag', {}))
    assert verdict(recording).startswith('The recording is empty')


def test_topics_without_a_message_are_not_counted_as_complete(tmp_path):
    recording = engine_mount.open(recorded(tmp_path / 'bag', {DISPLACEMENT: displacements(5)}))
    assert 'Nothing is known to be lost: 1 topics are complete' in verdict(recording)


@pytest.mark.parametrize(
    ('messages', 'sound', 'words'),
    [
        ({}, False, 'nothing was recorded'),
        ({DIAGNOSTICS: [EMPTY_DIAGNOSTICS]}, False, 'nothing was recorded'),
        ({DISPLACEMENT: displacements(5)}, True, 'Nothing is known to be lost'),
    ],
)
def test_record_beside_no_graph_says_that_nothing_came(tmp_path, messages, sound, words):
    console = Console(record=True, file=io.StringIO(), width=200)
    assert _told(recorded(tmp_path / 'bag', messages), console) is sound
    said = console.export_text()
    assert words in said
    assert ('known to be lost' in said) is sound


@pytest.fixture
def run(tmp_path):
    """Return the folder of a run with its recording."""
    (tmp_path / 'run').mkdir()
    recorded(tmp_path / 'run' / 'recording', {DISPLACEMENT: displacements(5)})
    return tmp_path / 'run'


@pytest.mark.parametrize('place', ['', 'recording', 'recording/recording_0.mcap'])
def test_audit_takes_the_folder_of_a_run_its_recording_or_a_file(run, place):
    result = CliRunner().invoke(app, ['audit', str(run / place)])
    assert result.exit_code == 0, result.output
    assert 'Nothing is known to be lost' in result.output


@pytest.mark.parametrize('place', ['', 'recording', 'recording/recording_0.mcap'])
def test_recover_takes_the_folder_of_a_run_its_recording_or_a_file(run, place):
    result = CliRunner().invoke(app, ['recover', str(run / place)])
    assert result.exit_code == 0, result.output
    (made,) = run.rglob('*_recovered')
    assert made.parent == (run / place if place == '' else (run / place).parent)
    assert engine_mount.open(made).message_count == 5
    shutil.rmtree(made)
