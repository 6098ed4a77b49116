"""Topics of a car and all others stand in chunks of their own: who reads these does not unpack those."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from recorded_drive import PERIOD, START, sample

import engine_mount
from engine_mount.recordings.cut import cut
from engine_mount.recordings.merge import merge
from engine_mount.recordings.recover import recover
from mount_recorder.bag_writer import BagWriter, SplitRule
from mount_recorder.mcap_writer import MESSAGE
from mount_recorder.topic_groups import OF_A_CAR, OF_OTHERS, topic_group
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT, RACK_TOPICS, SIM_TRUTH, TOPICS

COUNT = 400
CHUNK = 8192  # bytes
STRING = 'std_msgs/msg/String'
STREAMS = (SIM_TRUTH, DISPLACEMENT, CURRENT_SETPOINT)  # in each sample the simulator's first
OTHERS = ('/other/text', '/sim/truth')
TEXT = b'\x00\x01\x00\x00\x02\x00\x00\x00a\x00'


def write_drive(folder: Path, **options) -> BagWriter:
    """Write samples, of which each message has a log time of its own; the writer is not closed."""
    writer = BagWriter(folder, **{'chunk_size': CHUNK, **options})
    writer.add_topic('/other/text', STRING)
    for topic in STREAMS:
        writer.add_topic(f'/{topic.name}', topic.type)
    for name, raw, time in messages():
        writer.write(name, raw, time)
    return writer


def messages():
    """Yield (topic, payload, log time ns) in the order of time."""
    for index in range(COUNT):
        for place, topic in enumerate(STREAMS):
            yield f'/{topic.name}', sample(topic, index), START + index * PERIOD + place
        if index % 100 == 7:
            yield '/other/text', TEXT, START + index * PERIOD + len(STREAMS)


@pytest.fixture
def drive(tmp_path):
    writer = write_drive(tmp_path / 'drive')
    writer.close()
    return writer.folder


def chunks_of(folder):
    """Return for each chunk of all files its topics, as an independent reader finds them."""
    found = []
    for path in sorted(folder.glob('*.mcap')):
        with path.open('rb') as file:
            summary = make_reader(file).get_summary()
        names = {number: channel.topic for number, channel in summary.channels.items()}
        found += [
            {names[number] for number in index.message_index_offsets} for index in summary.chunk_indexes
        ]
    return found


def test_topics_of_a_car_are_one_group_and_all_others_another():
    groups = {topic.name: topic_group(f'/left/{topic.name}', topic.type) for topic in TOPICS + RACK_TOPICS}
    assert {name for name, group in groups.items() if group == OF_OTHERS} == {
        'sim/truth',
        'sim/chassis_acceleration',
        'sim/mount_force',
        'sim/clamp_force',
    }
    assert topic_group('/measured/force', 'geometry_msgs/msg/WrenchStamped') == OF_OTHERS
    assert topic_group('/displacement', 'sensor_msgs/msg/Imu') == OF_OTHERS
    assert topic_group('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray') == OF_A_CAR


@pytest.mark.parametrize('made', ['written', 'split', 'cut', 'merged', 'recovered'])
def test_a_chunk_holds_topics_of_one_group_alone(drive, tmp_path, made):
    out = tmp_path / 'out'
    if made == 'written':
        out = drive
    elif made == 'split':
        write_drive(out, split=SplitRule(duration=COUNT // 3 * PERIOD)).close()
    elif made == 'cut':
        cut(engine_mount.open(drive), out, 0.1, 0.3)
    elif made == 'merged':
        merge([engine_mount.open(drive)], out)
    else:
        recover(drive, out)
    chunks = chunks_of(out)
    assert all(topics.isdisjoint(OTHERS) or topics <= set(OTHERS) for topics in chunks)
    assert any(topics.isdisjoint(OTHERS) for topics in chunks)
    assert any(topics <= set(OTHERS) for topics in chunks)


def without(path, group):
    """Spoil the packed bytes of all chunks of a group; the checksum of the file is mended."""
    content = bytearray(path.read_bytes())
    with path.open('rb') as file:
        summary = make_reader(file).get_summary()
    numbers = {
        number
        for number, channel in summary.channels.items()
        if topic_group(channel.topic, summary.schemas[channel.schema_id].name) == group
    }
    spoilt = 0
    for index in summary.chunk_indexes:
        if numbers & index.message_index_offsets.keys():
            end = index.chunk_start_offset + index.chunk_length
            content[end - index.compressed_size : end] = bytes(index.compressed_size)
            spoilt += 1
    (summary_begin,) = struct.unpack_from('<Q', content, len(content) - 28)
    struct.pack_into('<I', content, summary_begin - 4, zlib.crc32(content[: summary_begin - 13]))
    path.write_bytes(content)
    return spoilt


@pytest.mark.parametrize('group', [OF_A_CAR, OF_OTHERS])
def test_who_wants_one_group_unpacks_no_chunk_of_the_other(drive, group):
    wanted = {DISPLACEMENT: ('mount',)} if group == OF_OTHERS else {SIM_TRUTH: ('gap', 'velocity')}
    ((topic, names),) = wanted.items()
    whole = engine_mount.open(drive)[topic.name]
    stamps, columns = whole.stamps, {name: whole[name] for name in names}
    assert without(drive / 'drive_0.mcap', group) > 3
    recording = engine_mount.open(drive)
    recording.load_columns({topic.name: names})
    np.testing.assert_array_equal(recording[topic.name].stamps, stamps)
    for name in names:
        np.testing.assert_array_equal(recording[topic.name][name], columns[name])
    assert recording.warnings == []
    other = SIM_TRUTH if group == OF_OTHERS else DISPLACEMENT
    assert not len(recording[other.name])  # what was spoilt is really gone
    assert recording.warnings


def test_the_slow_group_goes_to_the_file_with_the_fast_one_and_of_none_waits_more_than_a_chunk(tmp_path):
    writer = BagWriter(tmp_path / 'bag', chunk_size=CHUNK)
    writer.add_topic('/other/text', STRING)
    for topic in STREAMS:
        writer.add_topic(f'/{topic.name}', topic.type)
    waiting, kept = dict.fromkeys((OF_A_CAR, OF_OTHERS), 0), 0
    for number, (name, raw, time) in enumerate(messages()):
        writer.write(name, raw, time)
        waiting[OF_OTHERS if name in OTHERS else OF_A_CAR] += MESSAGE.size + len(raw)
        if writer.kept > kept:
            assert writer.kept == number + 1
            assert writer.pending == 0
            kept, waiting = writer.kept, dict.fromkeys(waiting, 0)
        assert max(waiting.values()) < CHUNK
    assert kept
    writer.close()
