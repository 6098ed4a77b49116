"""A file cut anywhere, with any byte changed: what is read is what was written, and a sentence says the rest.

The originals are small recordings with every byte of a message defined, so that messages compare as bytes.
"""

import random
import shutil
from collections import Counter
from pathlib import Path

import pytest
from compared_drives import messages_of
from samples import PERIOD, START, sample

import engine_mount
from engine_mount.recordings import ReadingError
from engine_mount.recordings.audit import audit
from engine_mount.recordings.edit import RecoveryError, recover
from engine_mount.recordings.losses import as_json, as_table, losses, sentences
from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import AIR_GAP, COIL_RIPPLE, CURRENT_SETPOINT, DISPLACEMENT, SIM_TRUTH

TIMES = 200
LATCHED = b'\x00\x01\x00\x00\x02\x00\x00\x00a\x00'


@pytest.fixture(scope='module')
def intact(tmp_path_factory) -> Path:
    """Return 60 samples in chunks of two groups, with a latched topic and a session."""
    folder = tmp_path_factory.mktemp('intact') / 'bag'
    writer = BagWriter(folder, chunk_size=2500)
    writer.add_topic('/session', 'std_msgs/msg/String')
    for topic in (AIR_GAP, SIM_TRUTH, DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT):
        writer.add_topic(f'/{topic.name}', topic.type)
    writer.write('/session', LATCHED, START - 5)
    writer.write('/air_gap', sample(AIR_GAP, 0), START - 3)
    for index in range(60):
        for topic in (SIM_TRUTH, DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT):
            sent = START + index * PERIOD + 100_000
            writer.write(f'/{topic.name}', sample(topic, index), sent + 50_000, sent)
    writer.close()
    return folder


def counted(recording):
    """Return how often each message (topic, payload, receive time, publish time) is read."""
    return Counter((name, *each) for name, found in messages_of(recording).items() for each in found)


def before_all_messages(intact, change, place, error):
    """Require that the file was cut before the end of its first chunk."""
    assert change is cut, f'{place}: {error}'
    assert place < engine_mount.open(intact).files[0].chunks[0].end, f'{place}: {error}'


def damaged_copies(intact, folder, change):
    """Yield 200 folders in which `change` was made to the bytes of the file, with what was changed."""
    content = (intact / 'bag_0.mcap').read_bytes()
    generator = random.Random(20)
    copy = folder / 'bag'
    copy.mkdir()
    (copy / 'metadata.yaml').write_bytes((intact / 'metadata.yaml').read_bytes())
    for place in generator.sample(range(len(content)), TIMES):
        (copy / 'bag_0.mcap').write_bytes(change(content, place, generator))
        yield copy, place


def cut(content, place, _):
    return content[:place]


def flip(content, place, generator):
    return content[:place] + bytes([content[place] ^ generator.randrange(1, 256)]) + content[place + 1 :]


@pytest.mark.parametrize('change', [cut, pytest.param(flip, marks=pytest.mark.slow)])
def test_what_is_read_and_recovered_is_what_was_written_and_sentences_say_the_rest(intact, tmp_path, change):
    original = counted(engine_mount.open(intact))
    for copy, place in damaged_copies(intact, tmp_path, change):
        alone, out = place % 2, tmp_path / 'out'  # with and without the description beside the file
        path = copy / 'bag_0.mcap' if alone else copy
        try:
            recording = engine_mount.open(path)
            recovery = recover(path, out)
        except (ReadingError, RecoveryError) as error:
            before_all_messages(intact, change, place, error)
            assert not out.exists()
            continue
        listed, found = recording.message_count, counted(recording)
        assert found <= original, place
        assert listed in (found.total(), original.total()), place
        assert recording.warnings, place
        entries = audit(recording)
        told = losses(recording, entries)
        as_json(entries, told)
        as_table(entries)
        assert sentences(entries, told), place
        recovered = engine_mount.open(out)
        assert counted(recovered) == found, place
        assert recovered.whole, place
        assert recovered.warnings == [], place
        assert recovery.kept == found.total(), place
        for whole in (recording.whole, recovery.complete):
            assert whole == (found == original) or (alone and change is cut), place
            assert whole <= (found == original), place
        assert ('lost' in str(recovery)) != recovery.complete, place
        if recovery.lost is not None:
            assert recovery.lost == original.total() - found.total(), place
        shutil.rmtree(out)
