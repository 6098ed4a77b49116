"""Recordings in several files: nothing lost, nothing twice."""

import errno

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from read_back import description, messages_in, pieces_of, read_back, text_in
from rosbags.highlevel import AnyReader
from samples import PERIOD, START, sample
from small_disk import small_disk

from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.record_file import RecordFile
from mount_ros.messages.cdr import string_message
from mount_ros.topics import DISPLACEMENT

STRING = 'std_msgs/msg/String'
COUNT = 20_000
LIMIT = 120_000  # bytes
AT_ONCE = 1  # bytes: each chunk fills a file


def test_no_file_becomes_larger_than_the_size_asked_for_and_the_description_lists_all(tmp_path):
    folder = tmp_path / 'bag'
    writer = BagWriter(folder, split_size=LIMIT, chunk_size=4096)
    writer.add_topic('/displacement', DISPLACEMENT.type)
    for index in range(COUNT):
        writer.write('/displacement', sample(DISPLACEMENT, index), START + index * PERIOD)
    writer.close()
    sizes = [path.stat().st_size for path in pieces_of(folder)]
    assert max(sizes) <= LIMIT
    assert min(sizes[:-1]) > LIMIT // 3, 'files are split long before they are full'
    bag, counts = description(folder), [len(messages_in(path)) for path in pieces_of(folder)]
    assert [file['path'] for file in bag['files']] == [path.name for path in pieces_of(folder)]
    assert [file['message_count'] for file in bag['files']] == counts
    last = bag['files'][-1]
    assert last['starting_time']['nanoseconds_since_epoch'] == START + sum(counts[:-1]) * PERIOD
    assert last['duration']['nanoseconds'] == (counts[-1] - 1) * PERIOD
    assert bag['starting_time']['nanoseconds_since_epoch'] == START
    assert bag['duration']['nanoseconds'] == (COUNT - 1) * PERIOD
    for place in (folder, pieces_of(folder)[1]):
        with AnyReader([place]) as reader:
            assert (
                len(list(reader.messages()))
                == reader.message_count
                == (COUNT if place == folder else counts[1])
            )


def test_disk_too_full_for_the_next_file_ends_the_recording_with_all_before_it(tmp_path):
    disk = small_disk((1 << 20) + 100_000)
    opened = []

    def open_file(path):
        if opened:
            raise OSError(errno.ENOSPC, 'the disk of the test')
        opened.append(path)
        return disk(path)

    writer = BagWriter(tmp_path / 'bag', split_size=AT_ONCE, chunk_size=1, open_file=open_file)
    writer.add_topic('/text', STRING)
    writer.write('/text', string_message('x'), 0)
    with pytest.raises(RecordingError, match='closed and readable'):
        writer.write('/text', string_message('y'), 10)
    assert len(read_back(tmp_path / 'bag', '/text')) == 1


def test_a_file_whose_end_cannot_be_written_at_a_split_is_named_and_keeps_its_messages(tmp_path):
    class BrokenFirst(RecordFile):
        broken = False

        def _write_some(self, data):
            if self.broken:
                raise OSError(errno.EIO, 'broken')
            return super()._write_some(data)

        def release_room(self):  # before the end is written
            self.broken = self.path.name == 'bag_0.mcap'
            super().release_room()

    writer = BagWriter(tmp_path / 'bag', split_size=AT_ONCE, chunk_size=1, open_file=BrokenFirst)
    writer.add_topic('/text', STRING)
    writer.write('/text', string_message('x'), 0)
    named = r'broken\); bag_0\.mcap ends without its summary but with whole chunks'
    for time in (10, 11):
        with pytest.raises(RecordingError, match=named):
            writer.write('/text', string_message('y'), time)
    assert [text_in(kept.raw) for kept in read_back(tmp_path / 'bag', '/text')] == ['x']


topics = ('/stream', '/other')
times = st.integers(0, 2**62)
messages = st.lists(
    st.tuples(st.sampled_from(topics), st.binary(max_size=40), times, times),
    max_size=50,
)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(messages, st.sampled_from([0, AT_ONCE]), st.integers(1, 500))
def test_whatever_is_split_is_read_in_order_and_once(tmp_path_factory, messages, split_size, chunk_size):
    folder = tmp_path_factory.mktemp('bags') / 'bag'
    writer = BagWriter(folder, split_size=split_size, chunk_size=chunk_size)
    for topic in topics:
        writer.add_topic(topic, STRING)
    for message in messages:
        writer.write(*message)
    assert writer.kept + writer.pending == len(messages)
    writer.close()
    assert writer.kept == len(messages)
    for topic in topics:
        assert read_back(folder, topic) == [message for message in messages if message[0] == topic]
    assert all(messages_in(path) for path in pieces_of(folder)) or not messages, 'a file without a message'
