"""Any sequence of messages comes back as it was, here and in the readers of others."""

import tempfile
from pathlib import Path

import pytest
from compared_drives import messages_of
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from samples import by_rosbags

import engine_mount
from engine_mount.recordings.edit import recover
from mount_recorder.bag_writer import BagWriter

TOPICS = ('/displacement', '/mount_right/event', '/a')
TYPES = ('sensor_msgs/msg/JointState', 'std_msgs/msg/String', 'std_msgs/msg/String')
PAYLOADS = st.one_of(
    st.binary(max_size=40),
    st.integers(0, 3000).map(lambda size: b'\x00\x01\x00\x00' + bytes(range(256)) * (size // 256)),
)
TIMES = st.integers(1, 1 << 62)
MESSAGES = st.lists(st.tuples(st.sampled_from(TOPICS), PAYLOADS, TIMES, TIMES), max_size=60)


def written(folder, messages, split, chunk_size):
    writer = BagWriter(folder, chunk_size=chunk_size, split_size=split)
    for topic, type_name in zip(TOPICS, TYPES, strict=True):
        writer.add_topic(topic, type_name)
    for topic, raw, received, sent in messages:
        writer.write(topic, raw, received, sent)
    writer.close()
    return folder


def of_topic(messages, topic):
    return [message[1:] for message in messages if message[0] == topic]


def read(folder):
    recording = engine_mount.open(folder)
    found = messages_of(recording)
    assert recording.warnings == []
    assert recording.whole
    assert {name: topic.message_count for name, topic in recording.topics.items()} == {
        name: len(messages) for name, messages in found.items()
    }
    return found


@example([('/a', b'(\xb5/\xfd', 1, 1)], 1, 0)  # begins as if it were packed
@settings(deadline=None, derandomize=True, max_examples=40)
@given(MESSAGES, st.sampled_from([1, 300, 5000]), st.sampled_from([0, 1]))
def test_what_is_written_is_read_here_and_by_others(messages, chunk_size, split):
    with tempfile.TemporaryDirectory() as parent:
        folder = written(Path(parent) / 'bag', messages, split, chunk_size)
        found = read(folder)
        assert found == {topic: of_topic(messages, topic) for topic in TOPICS}
        assert sorted(by_rosbags(folder)) == sorted(
            (topic, received, raw) for topic, raw, received, _ in messages
        )
        if not split:
            assert sorted(by_mcap(folder)) == sorted(messages)
        if messages:
            recovered = recover(folder, Path(parent) / 'recovered')
            assert recovered.complete
            assert read(Path(parent) / 'recovered') == found


def by_mcap(folder):
    with (folder / f'{folder.name}_0.mcap').open('rb') as stream:
        return [
            (channel.topic, message.data, message.log_time, message.publish_time)
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages()
        ]


@pytest.mark.parametrize('kill', range(5))
def test_what_a_kill_leaves_is_read_here_and_recovered(tmp_path, kill):
    messages = [('/displacement', bytes([place % 251] * 94), 1000 + place, place) for place in range(400)]
    writer = BagWriter(tmp_path / 'bag', chunk_size=3000)
    writer.add_topic('/displacement', TYPES[0])
    for message in messages[: 60 + 67 * kill]:
        writer.write(*message)
    kept = writer.kept  # nothing more: the process is gone, with what is pending and without an end
    result = recover(tmp_path / 'bag', tmp_path / 'recovered')
    assert (result.kept, result.complete, result.lost) == (kept, False, None)
    assert 'how much, the file cannot tell' in str(result)
    assert read(tmp_path / 'recovered')['/displacement'] == of_topic(messages[:kept], '/displacement')
    assert len(list(by_mcap(tmp_path / 'recovered'))) == kept
    assert len(by_rosbags(tmp_path / 'recovered')) == kept
