"""A file of a recording with any bytes changed: no value that was not written passes for sound.

What a checksum covers is read as it was written or not at all. A value under none may be wrong; where the
file as a whole has a checksum, the recording is then not whole, which is an error of the audit. Where it has
none either, which a damaged one of 0 means too, a warning says that a damaged number would go unseen.
"""

import contextlib
import shutil
from collections import Counter

import pytest
from compared_drives import messages_of
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from ros_testing import mutated
from samples import write_drive

import engine_mount
from engine_mount.recordings import ReadingError
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import losses
from engine_mount.recordings.metadata import read_metadata
from engine_mount.recordings.series import SeriesError

SEEDS = st.integers(0, 1 << 62)
ONE_FILE = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
WRITERS = {
    'chunks with checksums': {},
    'chunks without': {'enable_crcs': False, 'enable_data_crcs': True, 'compression': CompressionType.NONE},
    'no summary': {'use_statistics': False, 'repeat_channels': False, 'repeat_schemas': False},
}


def rewritten(source, target, options):
    """Write the messages of one MCAP file as another program does."""
    with source.open('rb') as old, target.open('wb') as new:
        writer = Writer(new, chunk_size=2500, **options)
        writer.start('ros2', 'another')
        numbers = {}
        for schema, channel, message in make_reader(old).iter_messages():
            if channel.topic not in numbers:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, known, channel.metadata
                )
            number = numbers[channel.topic]
            times = message.log_time, message.publish_time, message.sequence
            writer.add_message(number, times[0], message.data, *times[1:])
        writer.finish()


@pytest.fixture(scope='module', params=['ours', *WRITERS])
def intact(request, tmp_path_factory):
    """Return the file of a recording and its content, by several writers."""
    folder = write_drive(tmp_path_factory.mktemp('intact') / 'bag', 5, chunk_size=700)
    file = folder / 'bag_0.mcap'
    if request.param != 'ours':
        rewritten(file, folder / 'other.mcap', WRITERS[request.param])
        (folder / 'other.mcap').replace(file)
    return file, file.read_bytes(), contents(engine_mount.open(folder))


def contents(recording):
    """Return how often each message with its times and numbers is in a recording."""
    found, messages = Counter(), messages_of(recording)
    for name in recording:
        series = recording[name]
        numbers = [(0.0,)] * len(series)
        with contextlib.suppress(SeriesError):
            columns = [series[column] for column in series.names]
            numbers = list(zip(series.stamps.tolist(), *columns, strict=True))
        for message, row in zip(messages[name], numbers, strict=True):
            found[(name, message, repr(row) if len(row) > 1 else '')] += 1
    return found


def judged(path):
    """Return what is read of a recording, whether the audit finds it sound, and whether no checksum tells."""
    recording = engine_mount.open(path)
    found = contents(recording)
    unproven = any(file.data_proof is None for file in recording.files) and any(
        'a damaged number in them would go unseen' in warning for warning in recording.warnings
    )
    return found, losses(recording, audit(recording)).sound, unproven


@ONE_FILE
@given(SEEDS, st.booleans())
@example(912, False)  # where chunks have no checksums, a stretch that is not understood puts all in doubt
def test_what_is_read_of_a_mutated_file_is_what_was_written_or_not_sound(intact, seed, alone):
    file, content, original = intact
    file.write_bytes(mutated(content, seed))
    with contextlib.suppress(ReadingError):
        found, sound, unproven = judged(file if alone else file.parent)
        assert found <= original or not sound or unproven


@given(SEEDS)
def test_a_mutated_description_is_understood_or_refused(described, seed):
    text = mutated(described, seed).decode(errors='surrogateescape')
    with contextlib.suppress(ReadingError):
        information = read_metadata(text)
        assert information.message_count >= 0
        assert all(isinstance(topic.name, str) for topic in information.topics)


@pytest.fixture(scope='module')
def described(tmp_path_factory):
    folder = write_drive(tmp_path_factory.mktemp('described') / 'bag', 3)
    content = (folder / 'metadata.yaml').read_bytes()
    shutil.rmtree(folder)
    return content
