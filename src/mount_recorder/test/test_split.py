"""Recordings in several files: nothing lost, nothing twice, each file complete in itself."""

import errno

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Metadata
from read_back import description, messages_in, pieces_of, read_back, records_of, text_in
from rosbags.highlevel import AnyReader
from samples import PERIOD, START, sample
from small_disk import small_disk

from mount_models.quantity import ParameterError
from mount_recorder.bag_writer import PIECE_RECORD, BagWriter, RecordingError, SplitRule, checked_rule
from mount_recorder.record_file import RecordFile
from mount_ros.topics import DISPLACEMENT

STRING = 'std_msgs/msg/String'
COUNT = 350


def string(text):
    data = text.encode() + b'\0'
    return b'\0\1\0\0' + len(data).to_bytes(4, 'little') + data


def split_bag(folder, count=COUNT, **options):
    """Write `count` displacements and, at samples 5 and 120, a latched session."""
    writer = BagWriter(folder, **{'split': SplitRule(duration=100 * PERIOD), 'chunk_size': 4096, **options})
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.add_topic('/session', STRING, latched=True)
    for index in range(count):
        if index in (5, 120):
            writer.write(
                '/session', string(f'at {index}'), START + index * PERIOD, START + index * PERIOD - 7
            )
        writer.write('/displacement', sample(DISPLACEMENT, index), START + index * PERIOD)
    writer.close()
    return folder


def test_duration_begins_a_new_file_with_the_message_that_reaches_it(tmp_path):
    folder = split_bag(tmp_path / 'bag')
    assert [path.name for path in pieces_of(folder)] == [f'bag_{number}.mcap' for number in range(4)]
    samples = [
        [kept.log_time for kept in messages_in(path) if kept.topic == '/displacement']
        for path in pieces_of(folder)
    ]
    assert [len(times) for times in samples] == [100, 100, 100, 50]
    assert [times[0] for times in samples] == [START + 100 * number * PERIOD for number in range(4)]


def test_latched_messages_stand_at_the_head_of_each_file_with_their_own_publish_time(tmp_path):
    heads = [messages_in(path)[0] for path in pieces_of(split_bag(tmp_path / 'bag'))]
    assert heads[1:] == [
        ('/session', string('at 5'), START + 100 * PERIOD, START + 5 * PERIOD - 7),
        ('/session', string('at 120'), START + 200 * PERIOD, START + 120 * PERIOD - 7),
        ('/session', string('at 120'), START + 300 * PERIOD, START + 120 * PERIOD - 7),
    ]


def test_head_of_a_piece_names_what_it_repeats(tmp_path):
    records = []
    for path in pieces_of(split_bag(tmp_path / 'bag')):
        metadata = [record for record in records_of(path) if isinstance(record, Metadata)]
        records += [record for record in metadata if record.name == PIECE_RECORD]
    assert [record.metadata['number'] for record in records] == ['1', '2', '3']
    assert [yaml.safe_load(record.metadata['repeated']) for record in records] == [['/session']] * 3


def test_each_file_alone_is_a_recording_for_every_reader(tmp_path):
    for number, path in enumerate(pieces_of(split_bag(tmp_path / 'bag'))):
        expected = messages_in(path)
        assert sum(kept.topic == '/displacement' for kept in expected) == [100, 100, 100, 50][number]
        latched = [text_in(kept.raw) for kept in expected if kept.topic == '/session']
        assert latched[-1] == ('at 5' if number == 0 else 'at 120')
        with AnyReader([path]) as reader:
            assert len(list(reader.messages())) == reader.message_count == len(expected)


def test_metadata_file_lists_all_files_with_their_own_counts_and_times(tmp_path):
    folder = split_bag(tmp_path / 'bag')
    bag = description(folder)
    assert [file['path'] for file in bag['files']] == [path.name for path in pieces_of(folder)]
    assert [file['message_count'] for file in bag['files']] == [101, 102, 101, 51]
    assert bag['files'][3]['starting_time']['nanoseconds_since_epoch'] == START + 300 * PERIOD
    assert bag['files'][3]['duration']['nanoseconds'] == 49 * PERIOD
    assert bag['starting_time']['nanoseconds_since_epoch'] == START
    assert bag['duration']['nanoseconds'] == (COUNT - 1) * PERIOD
    assert bag['message_count'] == COUNT + 5
    with AnyReader([folder]) as reader:
        assert len(list(reader.messages())) == reader.message_count == COUNT + 5


def test_no_file_becomes_larger_than_the_size_asked_for(tmp_path):
    limit = 120_000
    folder = split_bag(tmp_path / 'bag', 20_000, split=SplitRule(size=limit))
    sizes = [path.stat().st_size for path in pieces_of(folder)]
    assert max(sizes) <= limit
    assert min(sizes[:-1]) > limit // 3, 'files are split long before they are full'
    assert len(read_back(folder, '/displacement')) == 20_000


def test_disk_too_full_for_the_next_file_ends_the_recording_with_all_before_it(tmp_path):
    disk = small_disk((1 << 20) + 100_000)
    opened = []

    def open_file(path):
        if opened:
            raise OSError(errno.ENOSPC, 'the disk of the test')
        opened.append(path)
        return disk(path)

    writer = BagWriter(tmp_path / 'bag', split=SplitRule(duration=10), open_file=open_file)
    writer.add_topic('/text', STRING)
    writer.write('/text', string('x'), 0)
    with pytest.raises(RecordingError, match='closed and readable'):
        writer.write('/text', string('y'), 10)
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

    writer = BagWriter(tmp_path / 'bag', split=SplitRule(duration=10), open_file=BrokenFirst)
    writer.add_topic('/text', STRING)
    writer.write('/text', string('x'), 0)
    named = r'broken\); bag_0\.mcap ends without its summary but with whole chunks'
    with pytest.raises(RecordingError, match=named):
        writer.write('/text', string('y'), 10)
    with pytest.raises(RecordingError, match=named):
        writer.write('/text', string('z'), 11)
    assert [text_in(kept.raw) for kept in read_back(tmp_path / 'bag', '/text')] == ['x']


@pytest.mark.parametrize('step', [3600, -3600])
def test_a_step_of_the_log_times_neither_loses_nor_doubles_a_message(tmp_path, step):
    writer = BagWriter(tmp_path / 'bag', split=SplitRule(duration=100 * PERIOD))
    writer.add_topic('/displacement', DISPLACEMENT.type)
    for index in range(350):
        ahead = round(1e9 * step) if 50 <= index < 250 else 0
        writer.write('/displacement', sample(DISPLACEMENT, index), START + index * PERIOD + ahead)
    writer.close()
    found = sorted(kept.raw for kept in read_back(tmp_path / 'bag', '/displacement'))
    assert found == sorted(sample(DISPLACEMENT, index) for index in range(350))


def test_rule_given_as_numbers_is_checked_too():
    with pytest.raises(ParameterError, match='at least'):
        checked_rule(SplitRule(size=1))


topics = ('/stream', '/other', '/latched', '/latched_too')
messages = st.lists(
    st.tuples(st.sampled_from(topics), st.binary(max_size=40), st.integers(0, 60), st.integers(0, 60)),
    max_size=50,
)
rules = st.builds(SplitRule, st.sampled_from([0, 70_000, 71_000]), st.sampled_from([0, 1, 7, 25]))


@settings(deadline=None, derandomize=True, max_examples=60)
@given(messages, rules, st.integers(1, 500))
def test_whatever_is_split_is_read_in_order_and_once(tmp_path_factory, messages, rule, chunk_size):
    folder = tmp_path_factory.mktemp('bags') / 'bag'
    writer = BagWriter(folder, split=rule, chunk_size=chunk_size)
    for topic in topics:
        writer.add_topic(topic, STRING, latched=topic.startswith('/latched'))
    for message in messages:
        writer.write(*message)
    assert writer.kept + writer.pending >= len(messages)
    writer.close()
    assert writer.kept == len(messages)
    for topic in topics:
        assert read_back(folder, topic) == [message for message in messages if message[0] == topic]
    latest = {}
    for path in pieces_of(folder):
        found = messages_in(path)
        assert {entry[0]: (entry[1], entry[3]) for entry in found[: len(latest)]} == latest
        assert len(found) > len(latest) or not messages, 'a piece without a message of its own'
        latest |= {topic: (raw, sent) for topic, raw, _, sent in found if topic.startswith('/latched')}
